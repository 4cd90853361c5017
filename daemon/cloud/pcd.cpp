#include "daemon/cloud/encoding.hpp"

// PCD 0.7, the format of the Point Cloud Library.

namespace splid::cloud {
namespace {

class Pcd : public Encoding {
 public:
  explicit Pcd(bool ascii) : ascii_(ascii) {}

  [[nodiscard]] std::string head(const Summary& cloud) const override {
    std::string text =
        "# .PCD v0.7 - Point Cloud Data file format\n# written by splid " SPLID_VERSION;
    text.append("; ").append(axes_in_words).append("\n");
    std::string fields = "FIELDS x y z", sizes = "SIZE 4 4 4", types = "TYPE F F F";
    std::string counts = "COUNT 1 1 1";
    for (const Column& column : columns) {
      text.append("# ").append(column.name).append(": ").append(column.unit).append("\n");
      fields.append(" ").append(column.name);
      sizes.append(" ").append(std::to_string(bytes_of(column.kind)));
      types.append(column.kind == Kind::uint32 ? " U" : " F");
      counts.append(" 1");
    }
    // The count stands there twice.
    const std::string blanks = blanks_beside(cloud.points);
    const std::string points = std::to_string(cloud.points);
    text.append("# ").append(blanks).append(blanks).append("\nVERSION 0.7\n");
    for (const std::string& line : {fields, sizes, types, counts}) text.append(line).append("\n");
    text.append("WIDTH ").append(points).append("\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ");
    return text.append(points).append(ascii_ ? "\nDATA ascii\n" : "\nDATA binary\n");
  }

  void append(const Point& point, const Summary& /*cloud*/, std::string& out) const override {
    ascii_ ? append_text(point, out) : append_binary(point, out);
  }

 private:
  bool ascii_;
};

}  // namespace

std::unique_ptr<Encoding> pcd_encoding(bool ascii) { return std::make_unique<Pcd>(ascii); }

}  // namespace splid::cloud
