#include "config/pixel_list.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <utility>

#include "config/channel_name.hpp"
#include "config/json_text.hpp"
#include "config/option_reader.hpp"
#include "protocol/error.hpp"
#include "protocol/text.hpp"

namespace splid {
namespace {

using nlohmann::json;

[[noreturn]] void refuse_pixels(const std::string& place, const std::string& what) {
  throw Error(Fault::usage, place + ": " + what);
}

std::string count_fault(std::size_t count) {
  return "has " + std::to_string(count) + " pixels; " + std::to_string(most_pixels) +
         " are the most";
}

PixelOptions read_pixel(const json& value, const std::string& file, const std::string& place) {
  OptionReader reader(value, file, place);
  PixelOptions pixel;
  pixel.describe(reader);
  reader.finish();
  if (!value.contains("name")) pixel.name = std::to_string(pixel.input);
  return pixel;
}

// place: of the list in `file`; empty where it is the whole file.
std::vector<PixelOptions> read_json_list(const json& list, const std::string& file,
                                         const std::string& place) {
  const std::string whole = file + (place.empty() ? "" : ": " + place);
  if (!list.is_array()) refuse_pixels(whole, shown(list) + " is no list; write [ { ... }, ... ]");
  if (list.empty()) refuse_pixels(whole, "[] has no pixel; name at least one, or leave it out");
  if (list.size() > most_pixels) refuse_pixels(whole, count_fault(list.size()));
  std::vector<PixelOptions> pixels;
  for (std::size_t i = 0; i < list.size(); ++i) {
    pixels.push_back(read_pixel(list[i], file, pointer_to(place, std::to_string(i))));
  }
  return pixels;
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  do {
    cells.emplace_back(trimmed(trimmed(take_until(line, ',')), "\""));
  } while (!line.empty());
  return cells;
}

// A number where the cell is one. Names stay text, and so does what is neither, "nan" and "inf"
// too, which the reader refuses.
json cell_value(const std::string& key, const std::string& cell) {
  double number = 0;
  const char* const end = cell.data() + cell.size();
  const auto [stop, error] = std::from_chars(cell.data(), end, number);
  const bool is_number = error == std::errc{} && stop == end && std::isfinite(number);
  if (key == "name" || !is_number) return cell;
  return number;
}

json row_value(const std::vector<std::string>& columns, const std::vector<std::string>& cells,
               const std::string& place) {
  if (cells.size() > columns.size()) {
    refuse_pixels(place, "has " + std::to_string(cells.size()) + " cells, and the first line " +
                             std::to_string(columns.size()) + " names of columns");
  }
  json row = json::object();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].empty()) continue;
    if (row.contains(columns[i])) refuse_pixels(place, "has two cells \"" + columns[i] + "\"");
    row[columns[i]] = cell_value(columns[i], cells[i]);
  }
  return row;
}

std::vector<PixelOptions> read_csv_list(const std::string& text, const std::string& file) {
  std::vector<std::string> columns;
  std::vector<PixelOptions> pixels;
  std::string_view rest = without_byte_order_mark(text);
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::string_view line = trimmed(take_until(rest, '\n'));
    if (line.empty()) continue;
    if (columns.empty()) {
      columns = cells_of(line);
      continue;
    }
    const std::string place = "line " + std::to_string(number);
    const std::string where = std::string(file).append(": ").append(place);
    if (pixels.size() == most_pixels) {
      refuse_pixels(where, "is one pixel more than the " + std::to_string(most_pixels) +
                               " that are the most");
    }
    const json row = row_value(columns, cells_of(line), where);
    pixels.push_back(read_pixel(row, file, place));
  }
  if (pixels.empty()) {
    refuse_pixels(file,
                  "has no pixel; a list is JSON, [{\"input\": 1}, ...], or CSV, whose first line "
                  "names the columns, such as name,input,azimuth_deg,elevation_deg");
  }
  return pixels;
}

bool is_json(std::string_view text) {
  text = without_byte_order_mark(text);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && (text[first] == '[' || text[first] == '{');
}

std::optional<OptionFault> channel_fault(const Config& config, std::size_t i) {
  const Tag photon = photon_tag(0, static_cast<int>(config.pixels[i].input));
  const std::array<std::array<std::string, 2>, 2> others{
      {{"/channels/sync", config.channels.sync}, {"/channels/encoder", config.channels.encoder}}};
  for (const auto& [pointer, name] : others) {
    const auto channel = parse_channel(name);
    if (!channel || !channel->matches(photon)) continue;
    return OptionFault{"/pixels/" + std::to_string(i) + "/input",
                       std::string(name).append(" is also ").append(pointer) +
                           "; a tag can have one meaning only"};
  }
  return std::nullopt;
}

std::optional<OptionFault> instrument_fault(const Config& config) {
  const std::optional<InputRange> range = config.source->inputs();
  if (!range) return std::nullopt;
  const std::string instrument = ", and an instrument of driver " + config.source_driver + " has ";
  for (std::size_t i = 0; i < config.pixels.size(); ++i) {
    const std::int64_t input = config.pixels[i].input;
    if (input >= range->least && input <= range->most) continue;
    return OptionFault{"/pixels/" + std::to_string(i) + "/input",
                       std::to_string(input) + " is no input" + instrument + "inputs " +
                           std::to_string(range->least) + " to " + std::to_string(range->most)};
  }
  if (config.pixels.size() <= range->count) return std::nullopt;
  return OptionFault{"/pixels", "has " + std::to_string(config.pixels.size()) + " pixels" +
                                    instrument + std::to_string(range->count) + " inputs"};
}

std::optional<OptionFault> list_fault(const Config& config) {
  if (auto fault = pixels_fault(config.pixels)) {
    fault->pointer = "/pixels" + fault->pointer;
    return fault;
  }
  if (auto fault = instrument_fault(config)) return fault;
  for (std::size_t i = 0; i < config.pixels.size(); ++i) {
    if (auto fault = channel_fault(config, i)) return fault;
    if (config.pulse.shape != Shape::tabulated || !config.pixels[i].sigma_ps) continue;
    return OptionFault{"/pixels/" + std::to_string(i) + "/sigma_ps",
                       "is for a gaussian pulse, and /pulse/shape is \"tabulated\"; leave it out"};
  }
  return std::nullopt;
}

}  // namespace

PixelList read_pixel_list(const json& value, const std::string& file, const ReadText& read) {
  if (!value.is_string()) return {"", read_json_list(value, file, "/pixels")};
  const std::filesystem::path named = value.get<std::string>();
  if (named.empty()) refuse_pixels(file + ": /pixels", "\"\" names no file");
  const auto folder = std::filesystem::path(file).parent_path();
  PixelList list{(folder / named).lexically_normal().string(), {}};
  const std::string text = read(list.file, file + ": /pixels: ");
  list.pixels = is_json(text) ? read_json_list(parse_json_text(text, list.file), list.file, "")
                              : read_csv_list(text, list.file);
  return list;
}

std::optional<OptionFault> pixel_list_fault(const Config& config) {
  auto fault = list_fault(config);
  if (fault && !config.pixels_file.empty())
    fault->what += " (the list of " + config.pixels_file + ")";
  return fault;
}

}  // namespace splid
