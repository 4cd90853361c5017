#pragma once

#include "daemon/study/svg_chart.hpp"
#include "daemon/study/tradeoff/tradeoff_report.hpp"

namespace splid {

// RMSE of distance, mm, and of velocity, cm/s, against the median processor time a frame: a curve a
// setting, through its frame lengths; the bound of each length as a level line from its fastest
// setting to its slowest; the chosen row named. Below, where frames are lost, the shares of those
// on a wrong peak and of those without a value. A panel that would show nothing is left out: none
// at all where no error is known and no frame lost.
//
// Threads: any. Errors: none.
Chart tradeoff_chart(const TradeoffReport& report);

}  // namespace splid
