#pragma once

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "daemon/stream/field_estimator.hpp"
#include "estimator/frame_estimator.hpp"

namespace splid {

// How an estimation thread estimates: what a reload replaces as one.
struct EstimatorInUse {
  // One for each kind of pixel among the thread's: pixels whose detectors and pulses are alike
  // share one, since its workspace is large.
  std::vector<FrameEstimator> estimators;
  std::vector<std::size_t> of_pixel;  // which of them, for each of the thread's pixels
  bool tracked = false;
  bool helped = false;  // a pixel that follows nothing begins where its neighbours see a target
  // Of the thread that joins the pixels of a frame; null where no scene asks for it.
  std::unique_ptr<FieldEstimator> field;

  FrameEstimator& of(std::size_t pixel) { return estimators[of_pixel[pixel]]; }
};

// A lane's estimator, and the way by which a reload hands in another: the estimation thread takes
// it between two frames by exchanging pointers, and leaves the old estimator to be freed elsewhere.
//
// Threads: in_use() and take_next() belong to the estimation thread, hand_in() to one other thread.
class LaneEstimator {
 public:
  explicit LaneEstimator(EstimatorInUse made)
      : in_use_(std::make_unique<EstimatorInUse>(std::move(made))) {}
  ~LaneEstimator() {
    delete next_.load();
    delete retired_.load();
  }
  LaneEstimator(const LaneEstimator&) = delete;
  LaneEstimator& operator=(const LaneEstimator&) = delete;

  EstimatorInUse& in_use() { return *in_use_; }

  // Takes the estimator that was handed in; returns false where there is none. Does not allocate.
  bool take_next() {
    if (next_.load(std::memory_order_relaxed) == nullptr || retired_.load() != nullptr)
      return false;
    retired_.store(in_use_.release());
    in_use_.reset(next_.exchange(nullptr));
    return true;
  }

  void hand_in(EstimatorInUse made) {
    delete next_.exchange(new EstimatorInUse(std::move(made)));
    // The estimation thread puts the estimator that it stops using into retired_, which must be
    // free when it takes the next estimator.
    delete retired_.exchange(nullptr);
  }

 private:
  std::unique_ptr<EstimatorInUse> in_use_;
  std::atomic<EstimatorInUse*> next_{nullptr};
  std::atomic<EstimatorInUse*> retired_{nullptr};
};

}  // namespace splid
