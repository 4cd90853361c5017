#include "drivers/simulator/random.hpp"

#include <bit>
#include <cmath>
#include <cstddef>

#include "drivers/simulator/portable_math.hpp"

namespace splid::simulator {
namespace {

constexpr std::size_t layers = 256;

// Edges and densities of the layers of a ziggurat, from the widest layer (0, which holds the tail)
// to the top. x[0] is the width of a box that has the base layer's area; x[1] is where the tail
// begins.
struct Ziggurat {
  std::array<double, layers + 1> x{};
  std::array<double, layers + 1> density{};
};

// area: of each layer; density_at_tail: the distribution's density where the tail begins.
// quantile: the x of a density, by portable_log.
template <class Quantile>
Ziggurat make_ziggurat(double tail, double area, double density_at_tail, Quantile quantile) {
  Ziggurat table;
  table.x[0] = area / density_at_tail;
  table.x[1] = tail;
  table.density[1] = density_at_tail;
  for (std::size_t i = 2; i < layers; ++i) {
    table.density[i] = table.density[i - 1] + area / table.x[i - 1];
    table.x[i] = quantile(table.density[i]);
  }
  table.x[layers] = 0;
  table.density[layers] = 1;
  return table;
}

constexpr double exponential_tail = 7.69711747013104972;
constexpr double normal_tail = 3.6541528853610088;

// Design note: tail and area are those of Doornik (2005) for 256 layers; the last argument but one
// is exp(-tail) and exp(-tail^2 / 2), written out so that no library function enters.
const Ziggurat exponential_table =
    make_ziggurat(exponential_tail, 0.0039496598225815571993, 0.00045413435384149677,
                  [](double density) { return -portable_log(density); });
const Ziggurat normal_table =
    make_ziggurat(normal_tail, 0.00492867323399, 0.0012602859304985975,
                  [](double density) { return std::sqrt(-2 * portable_log(density)); });

std::uint64_t splitmix(std::uint64_t& state) {
  state += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

// The upper 52 bits as a number in (0, 1): never 0, so that its logarithm exists, and never 1.
double unit(std::uint64_t bits) { return (static_cast<double>(bits >> 12U) + 0.5) * 0x1p-52; }

}  // namespace

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t state = seed;
  state = splitmix(state) + stream;
  for (std::uint64_t& word : state_) word = splitmix(state);
}

std::uint64_t Random::bits() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t shifted = state_[1] << 17U;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::uniform() { return unit(bits()); }

double Random::exponential() {
  for (;;) {
    const std::uint64_t word = bits();
    const std::uint64_t layer = word & 0xFFU;
    const double x = unit(word) * exponential_table.x[layer];
    if (x < exponential_table.x[layer + 1]) return x;
    bool accepted = false;
    const double edge = exponential_edge(layer, x, accepted);
    if (accepted) return edge;
  }
}

double Random::exponential_edge(std::uint64_t layer, double x, bool& accepted) {
  accepted = true;
  if (layer == 0) return exponential_tail - portable_log(uniform());
  const double low = exponential_table.density[layer];
  const double high = exponential_table.density[layer + 1];
  accepted = portable_log(low + uniform() * (high - low)) < -x;
  return x;
}

double Random::normal() {
  for (;;) {
    const std::uint64_t word = bits();
    const std::uint64_t layer = word & 0xFFU;
    const double sign = (word & 0x100U) != 0 ? 1.0 : -1.0;
    const double x = unit(word) * normal_table.x[layer];
    if (x < normal_table.x[layer + 1]) return sign * x;
    bool accepted = false;
    const double edge = normal_edge(layer, x, accepted);
    if (accepted) return sign * edge;
  }
}

double Random::normal_edge(std::uint64_t layer, double x, bool& accepted) {
  if (layer == 0) {
    const double beyond = -portable_log(uniform()) / normal_tail;
    accepted = -2 * portable_log(uniform()) > beyond * beyond;
    return normal_tail + beyond;
  }
  const double low = normal_table.density[layer];
  const double high = normal_table.density[layer + 1];
  accepted = portable_log(low + uniform() * (high - low)) < -0.5 * x * x;
  return x;
}

}  // namespace splid::simulator
