#include "protocol/counted_syncs.hpp"

#include <string>

#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid {
namespace {

[[noreturn]] void refuse(const char* what, double value_ps, const char* bounds) {
  throw Error(Fault::data, std::string("T3 records: ") + what + " of " + number_text(value_ps) +
                               " ps; it must be " + bounds);
}

}  // namespace

CountedSyncs::CountedSyncs(double period_ps) {
  if (!(period_ps >= 1 && period_ps <= 1e12)) {
    refuse("a time between syncs", period_ps, "from 1 to 1e12 ps");
  }
  whole_period_ps_ = static_cast<std::int64_t>(period_ps);
  rest_of_period_ps_ = period_ps - static_cast<double>(whole_period_ps_);
}

double step_of_time_ps(double resolution_s) {
  const double step_ps = resolution_s * 1e12;
  if (!(step_ps >= 1e-3 && step_ps <= 1e9)) {
    refuse("a resolution", step_ps, "from 1e-3 to 1e9 ps");
  }
  return step_ps;
}

}  // namespace splid
