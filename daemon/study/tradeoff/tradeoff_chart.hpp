#pragma once

#include "daemon/study/svg_chart.hpp"
#include "daemon/study/tradeoff/tradeoff_report.hpp"

namespace splid {

// A chart of the RMSE of distance (mm) and of velocity (cm/s) against the median processor time for
// a frame. Each setting is a curve through its frame lengths. The bound of each length is a level
// line from the length's fastest setting to its slowest, and the chosen row is named. Where frames
// are lost, further panels show the share of frames on a wrong peak and of frames without a value.
// A panel that would show nothing is left out, so the chart has no panel where no error is known
// and no frame is lost.
//
// Threads: any. Errors: none.
Chart tradeoff_chart(const TradeoffReport& report);

}  // namespace splid
