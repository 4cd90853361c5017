#pragma once

#include <cmath>

namespace splid {

// The sum of the logarithms of very many numbers above 0. Some twenty numbers are multiplied before
// the logarithm of their product is taken.
class LogSum {
 public:
  void add(double x) {
    product_ *= x;
    // A single number is far from either limit, so the product does not overflow.
    if (product_ > 1e-100 && product_ < 1e100) return;
    sum_ += std::log(product_);
    product_ = 1;
  }
  void add_times(double n, double x) {
    if (n == 1) {
      add(x);
    } else {
      sum_ += n * std::log(x);
    }
  }
  [[nodiscard]] double value() const { return sum_ + std::log(product_); }

 private:
  double sum_ = 0;
  double product_ = 1;
};

}  // namespace splid
