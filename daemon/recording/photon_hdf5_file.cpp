#include "daemon/recording/photon_hdf5_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "daemon/recording/hdf5_handle.hpp"
#include "daemon/recording/hdf5_value.hpp"
#include "protocol/error.hpp"
#include "protocol/json_writer.hpp"

namespace splid::recording {
namespace {

// Coarser steps than this leave nothing of where a photon is within its pulse.
constexpr double coarse_s = 1e-9;

// Timestamps count periods of the laser where their unit is a whole number of them to within this:
// rates are counted in whole hertz.
constexpr double most_rate_error = 1e-3;

// Times in ps stay as far below 2^63 as a frame's do.
constexpr double most_time_ps = 0x1p63 - 0x1p54;
constexpr double sorted_within_s = 1e-6;

// The largest time since its sync that a T3 record tells: the next one stands for any later time.
constexpr std::int64_t most_t3_steps = 32'766;
constexpr std::int64_t most_nanotime = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t looked_at_once = 65'536;

[[noreturn]] void refuse_photons(const std::string& what) { throw Error(Fault::data, what); }

// Whether it is a table that splid wrote.
bool is_frame_table(hid_t file) {
  return hdf5_attribute(file, "frames", "schema") == "splid.frame";
}

std::int32_t detector_of(std::int64_t value) {
  return value >= 0 && value <= most_photon_hdf5_detector ? static_cast<std::int32_t>(value) : -1;
}

}  // namespace

PhotonHdf5File::PhotonHdf5File(std::string file, const Warn& warn) : name_(std::move(file)) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // it would write to standard error
  const hid_t opened = H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (opened < 0) refuse_photons(name_ + ": the HDF5 library cannot open it: it is cut or damaged");
  file_ = std::make_unique<Hdf5Handle>(opened, H5Fclose);
  asked_by(name_, [&] {
    open([&](const std::string& text) { warn(name_ + ": " + text); });
    return 0;
  });
}

PhotonHdf5File::~PhotonHdf5File() = default;

void PhotonHdf5File::open(const Warn& warn) {
  check_format();
  find_group(warn);
  open_array(timestamps_, "timestamps");
  open_array(detectors_, "detectors");
  open_array(nanotimes_, "nanotimes");
  if (!timestamps_.data) {
    refuse_photons("has no " + timestamps_.path + ", and so no photons that splid could read");
  }
  header_.record_count = timestamps_.values;
  for (const Array* array : {&detectors_, &nanotimes_}) {
    if (!array->data || array->values == header_.record_count) continue;
    refuse_photons(array->path + " has " + std::to_string(array->values) + " values, and " +
                   timestamps_.path + " has " + std::to_string(header_.record_count) +
                   "; each photon needs one entry in both arrays");
  }
  read_times(warn);
  add_texts();
}

void PhotonHdf5File::check_format() const {
  if (hdf5_attribute(*file_, "/", "format_name") == "Photon-HDF5") return;
  if (is_frame_table(*file_)) {
    refuse_photons(
        "is a table of frames that splid wrote, and no recording; h5py, pandas, MATLAB and Julia "
        "read it (docs/reference/tables.md)");
  }
  refuse_photons(
      "is an HDF5 file, but not Photon-HDF5: its root has no attribute format_name. Where it has "
      "each detection's time in ps by one clock, have h5py write these as text, and "
      "make a PTU of that (docs/guide/recording.md, \"Recordings of other kinds\")");
}

void PhotonHdf5File::find_group(const Warn& warn) {
  group_ = "photon_data";
  if (hdf5_has(*file_, group_)) return;
  group_ = "photon_data0";
  if (!hdf5_has(*file_, group_)) {
    refuse_photons("has no /photon_data, and so no photons that splid could read");
  }
  if (!hdf5_has(*file_, "photon_data1")) return;
  warn(
      "holds several spots; /photon_data0 is read, and /photon_data1 and those after it are left "
      "out. To read another, rename its group to photon_data in a copy of the file, with h5py");
}

// Design note: the library keeps 1 MiB of an array's chunks, and unpacks a larger chunk anew for
// each block that is read of it, unless it is told how large chunks are.
void PhotonHdf5File::open_array(Array& array, const char* name) const {
  array.path = "/" + group_ + "/" + name;
  if (!hdf5_has(*file_, array.path)) return;
  const hid_t found = H5Dopen2(*file_, array.path.c_str(), H5P_DEFAULT);
  if (found < 0) refuse_photons(array.path + " is not a readable array");
  array.data = std::make_unique<Hdf5Handle>(found, H5Dclose);
  const Hdf5Handle type(H5Dget_type(*array.data), H5Tclose);
  const Hdf5Handle space(H5Dget_space(*array.data), H5Sclose);
  if (H5Tget_class(type) != H5T_INTEGER || H5Sget_simple_extent_ndims(space) != 1) {
    refuse_photons(array.path + " is no row of whole numbers, which the format asks for");
  }
  array.values = static_cast<std::uint64_t>(H5Sget_simple_extent_npoints(space));
  array.value_bytes = H5Tget_size(type);
  const Hdf5Handle layout(H5Dget_create_plist(*array.data), H5Pclose);
  hsize_t chunk = 0;
  if (H5Pget_layout(layout) != H5D_CHUNKED || H5Pget_chunk(layout, 1, &chunk) != 1) return;
  const Hdf5Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  const std::size_t bytes = std::max<std::size_t>(2 * chunk * array.value_bytes, 1 << 20);
  H5Pset_chunk_cache(access, H5D_CHUNK_CACHE_NSLOTS_DEFAULT, bytes, 1);
  array.data = std::make_unique<Hdf5Handle>(H5Dopen2(*file_, array.path.c_str(), access), H5Dclose);
}

// Absent where there is nothing of that name.
std::optional<double> PhotonHdf5File::number_at(const std::string& path) const {
  const std::string whole = group_ + "/" + path;
  const auto number = hdf5_number(*file_, whole);
  if (number || !hdf5_has(*file_, whole)) return number;
  const std::uint64_t values = hdf5_values(*file_, whole);
  if (values == 1) refuse_photons("/" + whole + " is no number");
  refuse_photons("/" + whole + " is an array of " + std::to_string(values) +
                 " values, and the format has one number there; write that number with h5py");
}

double PhotonHdf5File::needed_number(const std::string& path) const {
  const auto number = number_at(path);
  if (number) return *number;
  refuse_photons("has no number /" + group_ + "/" + path + ", without which it cannot be read");
}

void PhotonHdf5File::read_times(const Warn& warn) {
  const double unit_s = needed_number("timestamps_specs/timestamps_unit");
  if (!(unit_s >= 1e-12 && unit_s <= 1)) {
    refuse_photons("/" + group_ + "/timestamps_specs/timestamps_unit is " + number_text(unit_s) +
                   " s; it must be from 1e-12 to 1 s");
  }
  most_timestamp_ = static_cast<std::int64_t>(most_time_ps / (unit_s * 1e12));
  most_step_back_ = static_cast<std::int64_t>(sorted_within_s / unit_s);
  if (nanotimes_.values) return read_syncs(unit_s, warn);
  if (unit_s > 1e-3) {
    refuse_photons("/" + group_ + "/timestamps_specs/timestamps_unit is " + number_text(unit_s) +
                   " s, and there are no nanotimes; such photons have no place in a pattern");
  }
  header_.resolution_s = unit_s;
  if (unit_s > coarse_s) {
    warn("its times have steps of " + number_text(unit_s * 1e9) +
         " ns and there are no nanotimes, so that pulses shorter than that are not seen; record "
         "the photons' times in ps");
  }
}

void PhotonHdf5File::read_syncs(double unit_s, const Warn& warn) {
  const std::string name = "measurement_specs/laser_repetition_rate";
  const std::string path = group_ + "/" + name;
  const auto rate_hz = number_at(name);
  if (!rate_hz) {
    refuse_photons("has nanotimes and no /" + path +
                   ", so that nothing tells whether its timestamps count the laser's pulses. If "
                   "they do, add that number with h5py, 1 / timestamps_unit");
  }
  const double periods = unit_s * *rate_hz;
  if (!(std::abs(periods - std::round(periods)) <= most_rate_error * periods && periods > 0.5)) {
    refuse_photons("its timestamps have units of " + number_text(unit_s * 1e9) +
                   " ns, and the laser's periods are " + number_text(1e9 / *rate_hz) + " ns (/" +
                   path +
                   "): they count another clock than the laser's, so that nanotimes have no "
                   "place in a pattern. Record again, with syncs counted or in T2 mode");
  }
  const double step_s = needed_number("nanotimes_specs/tcspc_unit");
  if (!(step_s >= 1e-15 && step_s <= 1e-3)) {
    refuse_photons("/" + group_ + "/nanotimes_specs/tcspc_unit is " + number_text(step_s) +
                   " s; it must be from 1e-15 to 1e-3 s");
  }
  header_.is_t3 = true;
  header_.sync_period_s = unit_s;
  header_.resolution_s = step_s;
  const double bins = number_at("nanotimes_specs/tcspc_num_bins").value_or(0);
  const double most_bins = std::ldexp(1.0, 8 * static_cast<int>(nanotimes_.value_bytes));
  header_.time_steps =
      static_cast<std::uint64_t>(bins >= 1 && bins < most_bins ? bins : std::min(most_bins, 1e18));
  fit_nanotimes(warn);
}

// Makes the records' steps so coarse that they hold the largest nanotime.
void PhotonHdf5File::fit_nanotimes(const Warn& warn) {
  std::int64_t most = 0;
  for (std::uint64_t first = 0; first < header_.record_count; first += looked_at_once) {
    const std::uint64_t left = header_.record_count - first;
    read_block(nanotimes_, first, static_cast<std::size_t>(std::min(left, looked_at_once)));
    most = std::max(most, *std::max_element(nanotimes_.block.begin(), nanotimes_.block.end()));
  }
  nanotime_steps_ = (std::min(most, most_nanotime) + most_t3_steps - 1) / most_t3_steps;
  nanotime_steps_ = std::max<std::int64_t>(nanotime_steps_, 1);
  if (nanotime_steps_ == 1) return;
  const double step_s = header_.resolution_s;
  header_.resolution_s *= static_cast<double>(nanotime_steps_);
  header_.time_steps = std::min<std::uint64_t>(
      header_.time_steps / static_cast<std::uint64_t>(nanotime_steps_), most_t3_steps);
  warn(nanotimes_.path + " goes up to " + std::to_string(most) + ", and a T3 record of a PTU to " +
       std::to_string(most_t3_steps) + ": photons get steps of " +
       number_text(header_.resolution_s * 1e12) + " ps instead of " + number_text(step_s * 1e12) +
       " ps");
}

// What a PTU says too, under a PTU's names.
void PhotonHdf5File::add_texts() {
  const auto add = [&](const char* name, const std::optional<std::string>& text) {
    if (text) header_.tags.push_back({name, -1, PtuTagType::string, *text, 0});
  };
  add("HW_Type", "Photon-HDF5");
  add("CreatorSW_Name", hdf5_text(*file_, "identity/software"));
  add("CreatorSW_Version", hdf5_text(*file_, "identity/software_version"));
  // The time of the recording rather than the time of this file, where both are told.
  const auto recorded = hdf5_text(*file_, "provenance/creation_time");
  add("FileTime", recorded ? recorded : hdf5_text(*file_, "identity/creation_time"));
  add("File_Comment", hdf5_text(*file_, "description"));
  add("MeasurementType", hdf5_text(*file_, group_ + "/measurement_specs/measurement_type"));
  const auto duration_s = hdf5_number(*file_, "acquisition_duration");
  if (duration_s && *duration_s >= 0 && *duration_s < 1e12) {
    header_.tags.push_back({"MeasDesc_AcquisitionTime", -1, PtuTagType::integer,
                            std::int64_t{std::llround(*duration_s * 1e3)}, 0});
  }
}

void PhotonHdf5File::read_block(Array& array, std::uint64_t begin, std::size_t values) const {
  array.block.assign(values, 0);
  if (!array.data) return;
  const hsize_t first = begin;
  const hsize_t count = values;
  const Hdf5Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Hdf5Handle space(H5Dget_space(*array.data), H5Sclose);
  H5Sselect_hyperslab(space, H5S_SELECT_SET, &first, nullptr, &count, nullptr);
  if (H5Dread(*array.data, H5T_NATIVE_INT64, memory, space, H5P_DEFAULT, array.block.data()) >= 0) {
    return;
  }
  refuse_photons(
      array.path + " cannot be read from value " + std::to_string(begin) +
      " on: it is cut or damaged there, or packed by a filter that Debian's HDF5 library "
      "does not have; if h5dump reads it, pack it again with h5repack -f GZIP=5");
}

void PhotonHdf5File::refuse_row(const Array& array, std::size_t i, const std::string& why) const {
  refuse_photons(array.path + ", row " + std::to_string(taken_ + i) + ", is " +
                 std::to_string(array.block[i]) + why);
}

void PhotonHdf5File::check_timestamp(std::size_t i) {
  const std::int64_t value = timestamps_.block[i];
  const std::int64_t latest = latest_.value_or(value);
  if (value > most_timestamp_ || value < (header_.is_t3 ? 0 : -most_timestamp_)) {
    refuse_row(timestamps_, i,
               "; it must be from " + std::to_string(header_.is_t3 ? 0 : -most_timestamp_) +
                   " to " + std::to_string(most_timestamp_) + ": the file is damaged there");
  }
  if (latest - value > most_step_back_) {
    refuse_row(timestamps_, i,
               ", and a row before it is " + std::to_string(latest) +
                   ": its photons are not sorted by time, to 1 us; sort the rows of all arrays by "
                   "their timestamp, with h5py and numpy");
  }
  latest_ = std::max(latest, value);
}

std::uint32_t PhotonHdf5File::nanotime(std::size_t i) const {
  const std::int64_t value = nanotimes_.block[i];
  if (value >= 0 && value <= most_nanotime) {
    return static_cast<std::uint32_t>((value + nanotime_steps_ / 2) / nanotime_steps_);
  }
  refuse_row(nanotimes_, i,
             "; it must be from 0 to " + std::to_string(most_nanotime) +
                 ": take such photons out of all arrays, with h5py and numpy");
}

std::size_t PhotonHdf5File::read(std::span<PhotonHdf5Record> out) {
  return asked_by(name_, [&] { return read_rows(out); });
}

std::size_t PhotonHdf5File::read_rows(std::span<PhotonHdf5Record> out) {
  const auto photons =
      static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), header_.record_count - taken_));
  if (photons == 0) return 0;
  for (Array* array : {&timestamps_, &detectors_, &nanotimes_}) {
    read_block(*array, taken_, photons);
  }
  for (std::size_t i = 0; i < photons; ++i) {
    check_timestamp(i);
    out[i] = {timestamps_.block[i], nanotime(i), detector_of(detectors_.block[i])};
  }
  taken_ += photons;
  return photons;
}

}  // namespace splid::recording
