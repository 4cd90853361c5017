#include "daemon/cloud/encoding.hpp"

// PLY 1.0. CloudCompare shows the properties whose names begin with `scalar_`.

namespace splid::cloud {
namespace {

const char* type_of(Kind kind) {
  if (kind == Kind::float64) return "double";
  return kind == Kind::float32 ? "float" : "uint";
}

class Ply : public Encoding {
 public:
  explicit Ply(bool ascii) : ascii_(ascii) {}

  [[nodiscard]] std::string head(const Summary& cloud) const override {
    std::string text = "ply\nformat ";
    text.append(ascii_ ? "ascii" : "binary_little_endian").append(" 1.0\n");
    text.append("comment written by splid " SPLID_VERSION "; ").append(axes_in_words).append("\n");
    std::string properties = "property float x\nproperty float y\nproperty float z\n";
    for (const Column& column : columns) {
      text.append("comment scalar_").append(column.name).append(": ");
      text.append(column.unit).append("\n");
      properties.append("property ").append(type_of(column.kind)).append(" scalar_");
      properties.append(column.name).append("\n");
    }
    text.append("comment ").append(blanks_beside(cloud.points)).append("\nelement vertex ");
    text.append(std::to_string(cloud.points)).append("\n");
    return text.append(properties).append("end_header\n");
  }

  void append(const Point& point, const Summary& /*cloud*/, std::string& out) const override {
    ascii_ ? append_text(point, out) : append_binary(point, out);
  }

 private:
  bool ascii_;
};

}  // namespace

std::unique_ptr<Encoding> ply_encoding(bool ascii) { return std::make_unique<Ply>(ascii); }

}  // namespace splid::cloud
