#pragma once

namespace splid {

// What is so many deviations off is hardly chance: once in 16,000, to either side.
inline constexpr double unlikely_deviations = 4;
// What is further off is no chance: once in 1.7 million; of many that are looked at, six.
inline constexpr double sure_deviations = 5;
inline constexpr double sure_deviations_of_many = 6;

}  // namespace splid
