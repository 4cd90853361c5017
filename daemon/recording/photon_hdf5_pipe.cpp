#include "daemon/recording/photon_hdf5_pipe.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "daemon/recording/photon_hdf5_file.hpp"
#include "protocol/json_value.hpp"
#include "protocol/json_writer.hpp"

namespace splid::recording {
namespace {

constexpr std::size_t photons_at_once = 65'536;

// Ends the process's work where nobody reads any more.
struct NobodyReads {};

class PartWriter {
 public:
  explicit PartWriter(int descriptor) : descriptor_(descriptor) {}

  void write(PhotonHdf5Part part, std::span<const std::byte> bytes) const {
    const PhotonHdf5PartHead head{part, static_cast<std::uint32_t>(bytes.size())};
    write_all(std::as_bytes(std::span(&head, 1)));
    write_all(bytes);
  }
  void write(PhotonHdf5Part part, std::string_view text) const {
    write(part, std::as_bytes(std::span(text)));
  }

 private:
  void write_all(std::span<const std::byte> bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno != EINTR) throw NobodyReads();
      if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  int descriptor_;
};

void write_tags(PhotonHdf5File& file, PhotonHdf5Decoder& decoder, const PartWriter& out) {
  std::vector<PhotonHdf5Record> records(photons_at_once);
  // Of each photon, with a sync before it, and one that is left from the block before.
  std::vector<Tag> tags(2 * photons_at_once + 1);
  while (const std::size_t count = file.read(records)) {
    const auto progress = decoder.decode(std::as_bytes(std::span(records).first(count)), tags);
    out.write(PhotonHdf5Part::tags, std::as_bytes(std::span(tags).first(progress.tags)));
  }
}

// A unit that stands for a whole number of ps, but for what a double cannot hold, is that number.
double unit_ps(double unit_s) {
  const double ps = unit_s * 1e12;
  const double nearest_ps = std::round(ps);
  return std::abs(ps - nearest_ps) <= 1e-13 * ps ? nearest_ps : ps;
}

PhotonHdf5Decoder decoder_of(const RecordingHeader& header) {
  if (!header.is_t3) return {unit_ps(header.resolution_s), std::nullopt};
  return {static_cast<double>(whole_period_ps(header)), header.resolution_s};
}

void write_parts(const std::string& file, const PartWriter& out) {
  try {
    PhotonHdf5File photons(
        file, [&](const std::string& text) { out.write(PhotonHdf5Part::warning, text); });
    out.write(PhotonHdf5Part::header, photon_hdf5_header_json(photons.header()));
    PhotonHdf5Decoder decoder = decoder_of(photons.header());
    write_tags(photons, decoder, out);
    if (decoder.unknown_records() > 0) {
      out.write(PhotonHdf5Part::warning,
                file + ": " + std::to_string(decoder.unknown_records()) +
                    " photons are left out, since their detectors are not from 0 to 62");
    }
    out.write(PhotonHdf5Part::end, "");
  } catch (const std::exception& error) {
    out.write(PhotonHdf5Part::error, error.what());
  }
}

}  // namespace

std::string photon_hdf5_header_json(const RecordingHeader& header) {
  JsonWriter texts;
  JsonWriter integers;
  for (const PtuTag& tag : header.tags) {
    if (const auto* text = std::get_if<std::string>(&tag.value)) texts.text(tag.name, *text);
    if (const auto* value = std::get_if<std::int64_t>(&tag.value))
      integers.integer(tag.name, *value);
  }
  return JsonWriter()
      .flag("is_t3", header.is_t3)
      .number("resolution_s", header.resolution_s)
      .number("sync_period_s", header.sync_period_s)
      .integer("time_steps", header.time_steps)
      .integer("record_count", header.record_count)
      .object("texts", texts)
      .object("integers", integers)
      .finish();
}

RecordingHeader photon_hdf5_header_from_json(std::string_view json) {
  const auto parsed = json_value(json);
  RecordingHeader header;
  header.is_t3 = parsed.at("is_t3").get<bool>();
  header.resolution_s = parsed.at("resolution_s").get<double>();
  header.sync_period_s = parsed.at("sync_period_s").get<double>();
  header.time_steps = parsed.at("time_steps").get<std::uint64_t>();
  header.record_count = parsed.at("record_count").get<std::uint64_t>();
  // Absent where there are none.
  const auto none = nlohmann::json::object();
  const auto texts = parsed.value("texts", none);
  const auto integers = parsed.value("integers", none);
  for (const auto& [name, text] : texts.items()) {
    header.tags.push_back({name, -1, PtuTagType::string, text.get<std::string>(), 0});
  }
  for (const auto& [name, value] : integers.items()) {
    header.tags.push_back({name, -1, PtuTagType::integer, value.get<std::int64_t>(), 0});
  }
  return header;
}

std::int64_t whole_period_ps(const RecordingHeader& header) {
  return std::max<std::int64_t>(std::llround(header.sync_period_s * 1e12), 1);
}

void write_photon_hdf5(const std::string& file, int descriptor) {
  const PartWriter out(descriptor);
  try {
    write_parts(file, out);
  } catch (const NobodyReads&) {
    return;
  }
}

}  // namespace splid::recording
