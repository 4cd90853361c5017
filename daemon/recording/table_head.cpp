#include "daemon/recording/table_head.hpp"

#include <hdf5.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <span>
#include <stdexcept>
#include <utility>

#include "daemon/recording/hdf5_handle.hpp"
#include "protocol/error.hpp"
#include "protocol/frame_columns.hpp"

namespace splid::recording {
namespace {

// Stands where the checksum goes, so that its place can be found.
const std::string checksum_sign(TableHead::checksum_bytes, '#');

using Handle = Hdf5Handle;

template <class Result>
Result checked(Result result) {
  if (result < 0) throw std::runtime_error("the HDF5 library cannot make a table; is memory full?");
  return result;
}

Handle text_type() {
  const hid_t type = checked(H5Tcopy(H5T_C_S1));
  checked(H5Tset_size(type, H5T_VARIABLE));
  checked(H5Tset_cset(type, H5T_CSET_UTF8));
  return {type, H5Tclose};
}

// A truth value as h5py and PyTables write it.
Handle flag_type() {
  const hid_t type = checked(H5Tenum_create(H5T_STD_I8LE));
  const std::int8_t no = 0;
  const std::int8_t yes = 1;
  checked(H5Tenum_insert(type, "FALSE", &no));
  checked(H5Tenum_insert(type, "TRUE", &yes));
  return {type, H5Tclose};
}

Handle name_type(std::size_t bytes) {
  const hid_t type = checked(H5Tcopy(H5T_C_S1));
  checked(H5Tset_size(type, bytes));
  checked(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return {type, H5Tclose};
}

void insert(hid_t row, const FrameColumn& column, hid_t type) {
  checked(H5Tinsert(row, std::string(column.name).c_str(), column.offset, type));
}

Handle row_type() {
  const hid_t row = checked(H5Tcreate(H5T_COMPOUND, frame_row_bytes()));
  for (const FrameColumn& column : frame_columns()) {
    switch (column.type) {
      case ColumnType::number:
        insert(row, column, H5T_NATIVE_DOUBLE);
        break;
      case ColumnType::integer:
        insert(row, column, H5T_NATIVE_INT64);
        break;
      case ColumnType::flag:
        insert(row, column, flag_type());
        break;
      case ColumnType::text:
        insert(row, column, name_type(column.bytes));
        break;
    }
  }
  return {row, H5Tclose};
}

void add_attribute(hid_t where, const char* name, const std::string& value) {
  const Handle type = text_type();
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* text = value.c_str();
  checked(H5Awrite(attribute, type, &text));
}

void add_units(hid_t table) {
  std::vector<std::string> units;
  for (const FrameColumn& column : frame_columns()) units.emplace_back(column.unit);
  std::vector<const char*> texts;
  texts.reserve(units.size());
  for (const std::string& unit : units) texts.push_back(unit.c_str());
  const hsize_t count = texts.size();
  const Handle type = text_type();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Handle attribute(H5Acreate2(table, "units", type, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  checked(H5Awrite(attribute, type, texts.data()));
}

// A text beside the table, of any length: an attribute holds 64 KiB at most. Of fixed length, which
// PyTables reads too.
void add_text(hid_t file, const char* name, const std::string& value) {
  const hid_t copy = checked(H5Tcopy(H5T_C_S1));
  const Handle type(copy, H5Tclose);
  checked(H5Tset_size(type, std::max<std::size_t>(value.size(), 1)));
  checked(H5Tset_strpad(type, H5T_STR_NULLPAD));
  checked(H5Tset_cset(type, H5T_CSET_UTF8));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  // The time of day would differ between the two images that changing_fields() compares.
  checked(H5Pset_obj_track_times(how, false));
  const Handle dataset(H5Dcreate2(file, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT),
                       H5Dclose);
  checked(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value.c_str()));
}

struct Image {
  std::string bytes;          // of the file
  std::size_t first_row = 0;  // where the rows begin, and end with the file
};

// The table itself is written last, so that its rows stand at the file's end.
std::size_t add_frames(hid_t file, hsize_t rows) {
  const Handle type = row_type();
  const Handle space(H5Screate_simple(1, &rows, nullptr), H5Sclose);
  const Handle how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  checked(H5Pset_fill_time(how, H5D_FILL_TIME_NEVER));
  checked(H5Pset_obj_track_times(how, false));
  const Handle table(H5Dcreate2(file, "frames", type, space, H5P_DEFAULT, how, H5P_DEFAULT),
                     H5Dclose);
  add_units(table);
  add_attribute(table, "schema", "splid.frame");
  checked(H5Fflush(file, H5F_SCOPE_LOCAL));
  const std::string nothing(rows * frame_row_bytes(), '\0');
  checked(H5Dwrite(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, nothing.data()));
  return H5Dget_offset(table);
}

Image make_image(const TableFacts& facts, hsize_t rows) {
  constexpr std::size_t image_step_bytes = 1 << 16;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  checked(H5Pset_fapl_core(access, image_step_bytes, false));
  checked(H5Pset_meta_block_size(access, 0));
  checked(H5Pset_small_data_block_size(access, 0));
  const Handle how(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  checked(H5Pset_obj_track_times(how, false));
  const Handle file(H5Fcreate("frames.h5", H5F_ACC_TRUNC, how, access), H5Fclose);
  add_attribute(file, "program", facts.program);
  add_attribute(file, "recording", facts.recording);
  add_attribute(file, "recording_sha256", checksum_sign);
  add_text(file, "configuration", facts.config_json);
  add_text(file, "pattern", facts.pattern_json);
  Image image;
  image.first_row = add_frames(file, rows);
  checked(H5Fflush(file, H5F_SCOPE_LOCAL));
  image.bytes.resize(static_cast<std::size_t>(checked(H5Fget_file_image(file, nullptr, 0))));
  checked(H5Fget_file_image(file, image.bytes.data(), image.bytes.size()));
  return image;
}

std::uint64_t number_at(const std::string& bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 8; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void set_number(std::string& bytes, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 8; ++i) bytes[at + i] = static_cast<char>(value >> (8 * i) & 0xFFU);
}

// The numbers that are begin + per_row for a table of one row, and per_row more for two rows.
void find_fields(const std::string& one, const std::string& two, std::uint64_t begin,
                 std::uint64_t per_row, std::vector<TableHead::Field>& fields) {
  for (std::size_t at = one.size() - 8; at > 0; --at) {
    if (number_at(one, at) != begin + per_row || number_at(two, at) != begin + 2 * per_row)
      continue;
    const bool is_inside_another =
        std::any_of(fields.begin(), fields.end(),
                    [at](const auto& found) { return at < found.at + 8 && found.at < at + 8; });
    if (!is_inside_another) fields.push_back({at, begin, per_row});
  }
}

// The file's end, the bytes of the table, and the number of its rows, which HDF5 keeps as the most
// rows that the table may have, too; and where the rows begin, which stands before their bytes.
std::vector<TableHead::Field> changing_fields(const std::string& one, const std::string& two) {
  const std::uint64_t row = frame_row_bytes();
  std::vector<TableHead::Field> fields;
  find_fields(one, two, one.size(), row, fields);
  find_fields(one, two, 0, row, fields);
  find_fields(one, two, 0, 1, fields);
  std::string made = one;
  for (const auto& field : fields) set_number(made, field.at, field.value(2));
  if (made == two && fields.size() == 4 && number_at(one, fields[1].at - 8) == one.size()) {
    fields.push_back({fields[1].at - 8, one.size(), 0, true});
    return fields;
  }
  throw std::runtime_error(
      "this version of the HDF5 library lays tables out in another way than splid was tried with; "
      "write .csv instead");
}

}  // namespace

TableFormat table_format_of(const std::string& file, const std::string& asked_by) {
  if (file.ends_with(".h5")) return TableFormat::hdf5;
  if (file.ends_with(".csv")) return TableFormat::csv;
  throw Error(Fault::usage, asked_by + " " + file +
                                ": a table of frames ends in .h5 (HDF5) or in .csv (text); give "
                                "it a name such as frames.h5");
}

std::string table_beside(const std::string& recording, RecordFrames tables) {
  return recording + (tables == RecordFrames::csv ? ".frames.csv" : ".frames.h5");
}

std::array<std::string, 3> table_files_beside(const std::string& recording) {
  const std::string csv = table_beside(recording, RecordFrames::csv);
  return {table_beside(recording, RecordFrames::hdf5), csv, facts_file_of(csv)};
}

std::string facts_file_of(const std::string& table) { return table + ".facts.json"; }

TableHead::Piece TableHead::of_rows(std::uint64_t rows) const {
  std::string changed = bytes;
  std::size_t first = bytes.size(), end = 0;
  for (const Field& field : std::span(fields).subspan(1)) {
    set_number(changed, field.at, field.value(rows));
    first = std::min(first, field.at);
    end = std::max(end, field.at + sizeof(std::uint64_t));
  }
  return {first, changed.substr(first, end - first)};
}

TableHead make_hdf5_head(const TableFacts& facts) {
  static std::mutex mutex;  // the library is made for one thread
  const std::scoped_lock lock(mutex);
  checked(H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr));  // it would write to standard error
  const Image one = make_image(facts, 1);
  const Image two = make_image(facts, 2);
  const std::size_t row = frame_row_bytes();
  if (one.first_row != two.first_row || one.first_row + row != one.bytes.size() ||
      two.first_row + 2 * row != two.bytes.size()) {
    throw std::runtime_error(
        "this version of the HDF5 library puts rows elsewhere than splid was "
        "tried with; write .csv instead");
  }
  TableHead head;
  head.bytes = one.bytes.substr(0, one.first_row);
  head.fields = changing_fields(head.bytes, two.bytes.substr(0, two.first_row));
  for (const TableHead::Field& field : head.fields)
    set_number(head.bytes, field.at, field.value(0));
  head.checksum_at = head.bytes.find(checksum_sign);
  std::fill_n(head.bytes.begin() + static_cast<std::ptrdiff_t>(head.checksum_at),
              TableHead::checksum_bytes, '\0');
  return head;
}

TableHead make_csv_head() {
  TableHead head;
  head.bytes = frame_csv_head();
  return head;
}

}  // namespace splid::recording
