#include <algorithm>
#include <bit>
#include <optional>

#include "protocol/photon_hdf5_decode.hpp"
#include "tests/fuzz/decoded.hpp"

// The photons of a Photon-HDF5 file, as its reader hands them on: its units, which are refused or
// taken, then records, decoded at one go and in pieces. Each record is a photon or unknown; pieces
// make no difference.

namespace splid::test::fuzz_photon_hdf5 {
namespace {

std::size_t photons_of(const std::vector<Tag>& tags) {
  return static_cast<std::size_t>(std::count_if(
      tags.begin(), tags.end(), [](const Tag& tag) { return tag.kind == TagKind::photon; }));
}

void check(FuzzInput input) {
  const auto unit_ps = std::bit_cast<double>(input.take<std::uint64_t>());
  const auto step_s = std::bit_cast<double>(input.take<std::uint64_t>());
  std::optional<double> step;
  if (step_s != 0) step = step_s;
  std::optional<PhotonHdf5Decoder> begun;
  if (!accepts(Fault::data, [&] { begun.emplace(unit_ps, step); })) return;
  must(unit_ps >= 1 && unit_ps <= 1e12, "a timestamp's unit is one that is documented");
  must(!step || (*step * 1e12 >= 1e-3 && *step * 1e12 <= 1e9), "so is a nanotime's step");

  const auto records = input.rest();
  const std::size_t count = records.size() / sizeof(PhotonHdf5Record);
  PhotonHdf5Decoder at_once = *begun;
  const Decoded whole = decode_in_pieces(at_once, records, 2 * count + 1);
  must(photons_of(whole.tags) + whole.unknown == count, "each record is a photon or unknown");
  must(step || photons_of(whole.tags) == whole.tags.size(), "without nanotimes there are no syncs");
  PhotonHdf5Decoder bit_by_bit = *begun;
  must(decode_in_pieces(bit_by_bit, records, 1 + count % 5) == whole,
       "tags do not depend on the pieces");
}

}  // namespace
}  // namespace splid::test::fuzz_photon_hdf5

SPLID_FUZZ_TARGET(photon_hdf5) {
  splid::test::fuzz_photon_hdf5::check({data, size});
  return 0;
}
