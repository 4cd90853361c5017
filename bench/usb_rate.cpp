#include <chrono>
#include <cstdio>

#include "drivers/usb/tags16_usb.hpp"
#include "tests/support/scene_records.hpp"
#include "tests/support/stream_firmware.hpp"
#include "tests/support/usb_double.hpp"
#include "tests/support/usb_run.hpp"

// Measures the tags that come from an emulated USB device to the sink in a second. The kernel's
// side, libusb, the queue and the decoder are all in this process. The emulation's own cost is
// included; a real kernel costs less.

namespace splid {
namespace {

void measure(int transfers, int transfer_kib) {
  test::SceneLoop scene({test::paper_pattern(), test::bright_scene()}, 20, 150);
  test::StreamFirmware firmware([&](std::span<std::byte> room) { return scene(room); });
  test::UsbDouble device({{0x1209, 0x5a1d}, ""}, firmware);
  usb::Tags16Options options;
  options.usb_id = "1209:5a1d";
  options.usb.transfers = transfers;
  options.usb.transfer_kib = transfer_kib;
  firmware.set_silent(true);  // tags that come before the start are thrown away
  device.plug();
  test::SourceRun run(options, false);
  test::comes_true([&] { return !run.reports().empty(); });
  const auto began = std::chrono::steady_clock::now();
  firmware.set_silent(false);
  test::comes_true([&] { return run.photons() == scene.tags(); });
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  run.stop();
  std::printf("%3d transfers of %4d KiB: %6.1f M tags/s, %.0f MB/s; %zu of %zu tags, %zu losses\n",
              transfers, transfer_kib, static_cast<double>(run.photons()) / took.count() * 1e-6,
              static_cast<double>(run.counter("splid_usb_bytes_total")) / took.count() * 1e-6,
              run.photons(), scene.tags(), run.count(TagKind::loss_begin));
}

}  // namespace
}  // namespace splid

int main() {
  splid::measure(32, 256);
  splid::measure(16, 512);
  splid::measure(12, 1024);
}
