#include "drivers/simulator/picture.hpp"

#include <fstream>
#include <istream>
#include <limits>

#include "protocol/error.hpp"

namespace splid::simulator {
namespace {

constexpr std::uint32_t largest_side = 4096;
constexpr std::uint32_t largest_value = 65'535;

class PgmReader {
 public:
  explicit PgmReader(const std::string& file) : file_(file), in_(file, std::ios::binary) {}

  Picture read() {
    std::string magic(2, ' ');
    if (!in_ || !in_.read(magic.data(), 2)) refuse("cannot be read");
    if (magic != "P2" && magic != "P5") refuse("is no PGM picture: it must begin with P2 or P5");
    Picture picture;
    picture.columns = number("width", 1, largest_side);
    picture.rows = number("height", 1, largest_side);
    const std::uint32_t white = number("white", 1, largest_value);
    picture.values.resize(picture.columns * picture.rows);
    const bool bytes = magic == "P5";
    if (bytes) in_.get();  // the one white space before the bytes
    for (std::uint16_t& value : picture.values) {
      const std::uint32_t level = bytes ? binary(white) : number("value", 0, white);
      if (level > white) refuse("has a value above its white");
      value = static_cast<std::uint16_t>(level);
    }
    return picture;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Fault::usage, file_ + ": " + what);
  }

  std::uint32_t number(const char* name, std::uint32_t least, std::uint32_t largest) {
    while ((in_ >> std::ws) && in_.peek() == '#') {
      in_.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    std::int64_t value = 0;
    if (in_ >> value && value >= least && value <= largest)
      return static_cast<std::uint32_t>(value);
    refuse(std::string("the ") + name + " of the picture is missing or not from " +
           std::to_string(least) + " to " + std::to_string(largest));
  }

  std::uint32_t binary(std::uint32_t white) {
    std::uint32_t value = byte();
    if (white > 255) value = 256 * value + byte();
    return value;
  }

  std::uint32_t byte() {
    const int next = in_.get();
    if (next < 0) refuse("ends before its last value");
    return static_cast<std::uint32_t>(next);
  }

  std::string file_;
  std::ifstream in_;
};

}  // namespace

Picture read_pgm(const std::string& file) { return PgmReader(file).read(); }

}  // namespace splid::simulator
