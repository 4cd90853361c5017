#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/cloud_bytes.hpp"

namespace splid::test {

// A reader of LAS 1.4 files, made from the specification of the ASPRS (LAS 1.4 R15) alone: public
// header block, variable-length records, point data record format 6 and its extra bytes.
class LasReader {
 public:
  struct Record {
    std::string user, text, description;
    unsigned id = 0;
  };
  struct Extra {
    std::string name, description;
    unsigned type = 0;
    std::size_t offset = 0;  // in a point
  };
  struct Point {
    std::array<double, 3> place{};
    unsigned intensity = 0, return_number = 0, returns = 0;
    double gps_time = 0;
    std::map<std::string, double> extra;
  };

  explicit LasReader(std::string bytes) : bytes_(std::move(bytes)) {
    require(bytes_.substr(0, 4) == "LASF", "signature");
    require(at<std::uint8_t>(24) == 1 && at<std::uint8_t>(25) == 4, "version 1.4");
    require(at<std::uint16_t>(94) == 375, "header of 375 bytes");
    require((at<std::uint8_t>(104) & 0x3FU) == 6, "point data record format 6");
    // "Point record formats 6 to 10 shall have the WKT bit set and legacy counts of zero."
    require((at<std::uint16_t>(6) & 16U) != 0, "WKT bit");
    for (std::size_t i = 0; i < 6; ++i)
      require(at<std::uint32_t>(107 + 4 * i) == 0, "legacy count");
    require(at<std::uint64_t>(235) == 0 && at<std::uint32_t>(243) == 0, "no extended records");
    read_records();
    for (std::size_t i = 0; i < count(); ++i) points.push_back(read_point(i));
  }

  [[nodiscard]] bool gps_time_is_adjusted() const { return (at<std::uint16_t>(6) & 1U) != 0; }
  [[nodiscard]] std::string software() const { return text(58, 32); }
  [[nodiscard]] unsigned day() const { return at<std::uint16_t>(90); }
  [[nodiscard]] unsigned year() const { return at<std::uint16_t>(92); }
  [[nodiscard]] std::uint64_t count() const { return at<std::uint64_t>(247); }
  [[nodiscard]] std::uint64_t count_of_return(unsigned number) const {
    return at<std::uint64_t>(255 + 8 * (number - 1));
  }
  [[nodiscard]] double scale() const { return at<double>(131); }
  // 0: x, 1: y, 2: z.
  [[nodiscard]] double most(std::size_t axis) const { return at<double>(179 + 16 * axis); }
  [[nodiscard]] double least(std::size_t axis) const { return at<double>(187 + 16 * axis); }

  std::vector<Record> records;
  std::vector<Extra> extras;
  std::vector<Point> points;

 private:
  template <class Number>
  [[nodiscard]] Number at(std::size_t offset) const {
    return number_at<Number>(bytes_, offset);
  }
  // Up to the first zero.
  [[nodiscard]] std::string text(std::size_t offset, std::size_t most) const {
    const std::string field = bytes_.substr(offset, most);
    return field.substr(0, field.find('\0'));
  }
  static void require(bool holds, const char* what) {
    if (!holds) throw std::runtime_error(std::string("no LAS 1.4: ") + what);
  }

  void read_records() {
    std::size_t offset = 375;
    for (std::uint32_t i = 0; i < at<std::uint32_t>(100); ++i) {
      const std::size_t size = at<std::uint16_t>(offset + 20);
      Record record{text(offset + 2, 16), bytes_.substr(offset + 54, size), text(offset + 22, 32),
                    at<std::uint16_t>(offset + 18)};
      if (record.user == "LASF_Spec" && record.id == 4) read_extras(offset + 54, size);
      records.push_back(std::move(record));
      offset += 54 + size;
    }
    require(offset == at<std::uint32_t>(96), "points directly behind the records");
    require(bytes_.size() == offset + count() * at<std::uint16_t>(105), "size of the file");
  }

  void read_extras(std::size_t offset, std::size_t size) {
    require(size % 192 == 0, "descriptors of 192 bytes");
    const std::map<unsigned, std::size_t> bytes_of{{5, 4}, {9, 4}, {10, 8}};
    std::size_t in_point = 30;
    for (std::size_t at_byte = offset; at_byte < offset + size; at_byte += 192) {
      Extra extra{text(at_byte + 4, 32), text(at_byte + 160, 32), at<std::uint8_t>(at_byte + 2),
                  in_point};
      require(at<std::uint8_t>(at_byte + 3) == 0, "no limits and no scale");
      in_point += bytes_of.at(extra.type);
      extras.push_back(std::move(extra));
    }
    require(in_point == at<std::uint16_t>(105), "a point's size with its extra bytes");
  }

  [[nodiscard]] Point read_point(std::size_t i) const {
    const std::size_t start = at<std::uint32_t>(96) + i * at<std::uint16_t>(105);
    Point point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point.place.at(axis) = at<std::int32_t>(start + 4 * axis) * at<double>(131 + 8 * axis) +
                             at<double>(155 + 8 * axis);
    }
    point.intensity = at<std::uint16_t>(start + 12);
    point.return_number = at<std::uint8_t>(start + 14) & 15U;
    point.returns = at<std::uint8_t>(start + 14) >> 4U;
    point.gps_time = at<double>(start + 22);
    for (const Extra& extra : extras) {
      const std::size_t offset = start + extra.offset;
      point.extra[extra.name] = extra.type == 9   ? at<float>(offset)
                                : extra.type == 5 ? at<std::uint32_t>(offset)
                                                  : at<double>(offset);
    }
    return point;
  }

  std::string bytes_;
};

}  // namespace splid::test
