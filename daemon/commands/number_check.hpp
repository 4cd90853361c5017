#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <string>

namespace splid {

// Checks of an option's number. Their errors say what was given and what is expected; CLI11's own
// errors show bounds of 309 digits.

// A number in [min, max].
inline CLI::Validator number_between(double min, double max) {
  return {[min, max](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool is_number = !text.empty() && *end == '\0';
            if (is_number && value >= min && value <= max) return std::string();
            return fmt::format("\"{:.40}\" must be a number from {:g} to {:g}, without a unit",
                               text, min, max);
          },
          "NUMBER"};
}

inline CLI::Validator number_above_zero() {
  return {[](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool is_number = !text.empty() && *end == '\0';
            if (is_number && value > 0 && std::isfinite(value)) return std::string();
            return fmt::format("\"{:.40}\" must be a number above 0, without a unit", text);
          },
          "NUMBER"};
}

// A count: only digits. Without this check CLI11 would take -1 as the largest possible number.
inline CLI::Validator whole_number() {
  return {[](const std::string& text) {
            const bool is_whole = !text.empty() && text.size() < 20 &&
                                  text.find_first_not_of("0123456789") == std::string::npos;
            if (is_whole) return std::string();
            return fmt::format("\"{:.40}\" must be a whole number", text);
          },
          "NUMBER"};
}

}  // namespace splid
