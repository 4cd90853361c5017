#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdlib>
#include <limits>
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
            return fmt::format("\"{:.40}\" must be a number from {:.9g} to {:.9g}, without a unit",
                               text, min, max);
          },
          "NUMBER"};
}

// A number in (0, max].
inline CLI::Validator number_above_zero(double max = std::numeric_limits<double>::max()) {
  return {[max](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool is_number = !text.empty() && *end == '\0';
            if (is_number && value > 0 && value <= max) return std::string();
            const bool is_bounded = max < std::numeric_limits<double>::max();
            return fmt::format("\"{:.40}\" must be a number above 0{}, without a unit", text,
                               is_bounded ? fmt::format(" and at most {:.9g}", max) : "");
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

inline CLI::Validator whole_number_above_zero() {
  return {[](const std::string& text) {
            std::string fault = whole_number()(text);
            if (!fault.empty()) return fault;
            if (text.find_first_not_of('0') != std::string::npos) return std::string();
            return fmt::format("\"{:.40}\" must be a whole number above 0", text);
          },
          "NUMBER"};
}

// A count in [min, max].
inline CLI::Validator whole_number_between(std::uint64_t min, std::uint64_t max) {
  return {[min, max](const std::string& text) {
            std::string fault = whole_number()(text);
            if (!fault.empty()) return fault;
            const std::uint64_t value = std::stoull(text);
            if (value >= min && value <= max) return std::string();
            return fmt::format("\"{:.40}\" must be a whole number from {} to {}", text, min, max);
          },
          "NUMBER"};
}

}  // namespace splid
