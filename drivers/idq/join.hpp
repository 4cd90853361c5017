#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <vector>

namespace splid::idq {

using Times = std::vector<std::uint64_t>;  // ps, from the begin of the sub-acquisition

struct SubAcquisition {
  std::int64_t index = 0;
  std::vector<Times> of_input;  // in the order of the configuration
  bool lacks = false;           // times are missing
};

// Finds out which sub-acquisition each message of times is of. A message does not tell it, and an
// input that saw nothing may send none. The data link program counts, for each input, the
// sub-acquisitions that ended and their times: where its count of times is that of the messages,
// all of them are here, and belong to the sub-acquisitions that ended since that was last so.
//
// Threads: one. Errors: none.
class Join {
 public:
  // longest_ps: no time of a sub-acquisition is larger.
  Join(std::size_t inputs, std::int64_t longest_ps);

  // Takes a message. False where it is no list of times of a sub-acquisition.
  bool add(std::size_t input, std::string_view message);

  enum class Account {
    settled,  // all that the program counted is here
    open,     // some of it is not here yet, or not counted yet
    fell,     // the program counts anew
  };
  // Takes the counts of the data link program.
  Account settle(std::size_t input, std::int64_t acquisitions, std::uint64_t times);
  // Ends an account that stays open: the sub-acquisitions since it was settled lack times. Returns
  // how many these are.
  std::int64_t give_up(std::size_t input);
  // The instrument lost times: sub-acquisitions that were not taken yet, and the one that goes on,
  // may lack some.
  void doubt();

  // The next sub-acquisition that all inputs have; absent while there is none.
  std::optional<SubAcquisition> take();

 private:
  struct Part {
    Times times;
    bool lacks = false;
  };
  struct Input {
    std::vector<Times> messages;  // that belong to no sub-acquisition yet
    std::uint64_t received = 0;   // times
    std::int64_t acquisitions = 0;
    std::uint64_t times = 0;  // as the data link program last counted
    std::deque<Part> parts;   // from index next_ on
  };

  [[nodiscard]] std::int64_t ended(const Input& input) const;
  void put_lacking(Input& input) const;

  std::int64_t longest_ps_;
  std::int64_t next_ = 0;       // the index that take() gives next
  std::int64_t doubtful_ = -1;  // up to this index
  std::vector<Input> inputs_;
};

}  // namespace splid::idq
