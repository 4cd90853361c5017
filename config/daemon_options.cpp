#include "config/daemon_options.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "config/channel_name.hpp"
#include "config/endpoint.hpp"
#include "config/json_text.hpp"

namespace splid {
namespace {

// The framer puts a disorder of twice this in order; the other half is left to the instrument.
constexpr double most_delay_ps = 500'000;

struct NamedChannel {
  std::string pointer;
  std::string name;
};

std::vector<NamedChannel> all_channels(const ChannelOptions& options) {
  std::vector<NamedChannel> channels;
  for (std::size_t i = 0; options.pixels.empty() && i < options.photon.size(); ++i) {
    channels.push_back({"/photon/" + std::to_string(i), options.photon[i]});
  }
  channels.push_back({"/sync", options.sync});
  if (!options.encoder.empty()) channels.push_back({"/encoder", options.encoder});
  return channels;
}

std::optional<OptionFault> delays_fault(const ChannelOptions& options) {
  const std::vector<double>& delays_ps = options.delays_ps;
  if (delays_ps.empty() || !options.pixels.empty()) return std::nullopt;
  if (delays_ps.size() != options.photon.size()) {
    return OptionFault{"/delays_ps", "has " + std::to_string(delays_ps.size()) +
                                         " delays where /channels/photon has " +
                                         std::to_string(options.photon.size()) +
                                         " inputs; give one for each, 0 for the first"};
  }
  for (std::size_t i = 0; i < delays_ps.size(); ++i) {
    if (delays_ps[i] == 0 || parse_channel(options.photon[i])->kind == TagKind::photon) continue;
    return OptionFault{"/delays_ps/" + std::to_string(i),
                       "\"" + options.photon[i] + "\" is no input; only an input has a delay"};
  }
  const auto [least, most] = std::minmax_element(delays_ps.begin(), delays_ps.end());
  if (std::max(*most, 0.0) - std::min(*least, 0.0) <= most_delay_ps) return std::nullopt;
  return OptionFault{"/delays_ps",
                     "are more than 500000 ps apart, from each other or from the "
                     "syncs; tags would no longer come in order"};
}

std::optional<std::string> control_fault(std::string_view endpoint) {
  if (endpoint == "auto" || endpoint == "off") return std::nullopt;
  if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc:///")) {
    return "must be auto, off, a file as in ipc:///run/splid/control.sock, or an address as in "
           "tcp://127.0.0.1:9875";
  }
  return endpoint_fault(endpoint);
}

}  // namespace

void ChannelOptions::describe(OptionVisitor& visitor) {
  visitor.channels("photon", photon,
                   "inputs of the detector; several inputs count as one detector");
  visitor.numbers("delays_ps", delays_ps, {-most_delay_ps, most_delay_ps},
                  "delay of each photon input, such as by a longer cable, ps, subtracted from its "
                  "times; splid calibrate finds the delays");
  visitor.channel("sync", sync, "channel of the pattern syncs, one for each pattern period");
  visitor.channel("encoder", encoder, "channel of the encoder's sample clock; \"\": none");
}

std::vector<std::string> ChannelOptions::photon_names() const {
  if (pixels.empty()) return photon;
  std::vector<std::string> names;
  for (const std::int64_t input : pixels) names.push_back(std::to_string(input));
  return names;
}

std::optional<OptionFault> ChannelOptions::validate() const {
  if (photon.empty()) return OptionFault{"/photon", "[] names no input; at least 1 is needed"};
  const std::vector<NamedChannel> all = all_channels(*this);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::optional<ChannelName> channel = parse_channel(all[i].name);
    if (!channel) {
      return OptionFault{all[i].pointer, "\"" + all[i].name +
                                             "\" is no channel; it is sync, marker:1 to marker:15, "
                                             "or an input, -128 to 126"};
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (!overlap(*channel, *parse_channel(all[k].name))) continue;
      return OptionFault{all[i].pointer, "\"" + all[i].name + "\" takes tags of \"" + all[k].name +
                                             "\", which is given at " + all[k].pointer +
                                             "; a tag can have one meaning only"};
    }
  }
  return delays_fault(*this);
}

void FrameOptions::describe(OptionVisitor& visitor) {
  visitor.number("length_ms", length_ms, {0.1, 60000},
                 "length of a frame, rounded to a whole number of pattern periods, ms; of a scan, "
                 "the longest dwell to expect");
  visitor.text("by", by,
               "time: frames of length_ms; marker:N: from one marker to the next; "
               "line:START:STOP:PIXELS: a line of a scan from marker START to marker STOP, cut "
               "into PIXELS dwells, a frame each; auto: the lines that a recording's header or a "
               "simulated scanner tells of, else time");
  visitor.number("min_seen_fraction", min_seen_fraction, {0, 1},
                 "a frame is incomplete if losses leave a smaller fraction of it");
}

void RecordOptions::describe(OptionVisitor& visitor) {
  visitor.path("folder", folder,
               "folder for the recordings of splid run, made if it is not there; the oldest are "
               "removed; \"\": none");
  static constexpr std::array<const char*, 2> times = {"always", "asked"};
  choose(visitor, "when", when, times,
         "always: from the start; asked: after splid ctl record start");
  static constexpr std::array<const char*, 3> tables = {"off", "h5", "csv"};
  choose(visitor, "frames", frames, tables,
         "h5, csv: table of the frames beside each recording, of splid record too, as HDF5 or "
         "text; off: none");
  visitor.number("max_file_mib", max_file_mib, {1, 1e6},
                 "size of a file, MiB; then a new file begins");
  visitor.number("max_file_s", max_file_s, {1, 1e6}, "length of a file, s; then a new file begins");
  visitor.number("max_folder_gib", max_folder_gib, {0.004, 1e6},
                 "size of all recordings in the folder, GiB");
}

std::optional<OptionFault> RecordOptions::validate() const {
  constexpr double mib_per_gib = 1024;
  constexpr double least_files = 2;  // the file that is being written, and the file before it
  const double least_gib = least_files * (max_file_mib + 1) / mib_per_gib;
  if (max_folder_gib >= least_gib) return std::nullopt;
  return OptionFault{"/max_folder_gib", shown(max_folder_gib) + " is below " + shown(least_gib) +
                                            ", room for two files of max_file_mib"};
}

void PipelineOptions::describe(OptionVisitor& visitor) {
  visitor.integer("ring_capacity_tags", ring_capacity_tags, 1024, 268'435'456,
                  "capacity of the ring between source and framer, tags of 16 bytes");
  visitor.integer("estimation_threads", estimation_threads, 1, 64,
                  "number of frames estimated at the same time");
}

void PublishOptions::describe(OptionVisitor& visitor) {
  visitor.text("endpoint", endpoint,
               "endpoint for subscribers: tcp://127.0.0.1:PORT or ipc://PATH; for other machines, "
               "such as tcp://*:PORT, with the keys of security");
  visitor.text("local_endpoint", local_endpoint,
               "second endpoint, for viewers on this machine without keys: tcp://127.0.0.1:PORT or "
               "ipc://PATH; empty: none");
}

std::optional<OptionFault> PublishOptions::validate() const {
  if (const std::optional<std::string> fault = endpoint_fault(endpoint)) {
    return OptionFault{"/endpoint", "\"" + endpoint + "\" " + *fault};
  }
  if (local_endpoint.empty()) return std::nullopt;
  std::optional<std::string> fault = endpoint_fault(local_endpoint);
  if (!fault && !is_on_this_machine(local_endpoint)) {
    fault =
        "is not on this machine, and has neither encryption nor a check of who listens; write "
        "it as in tcp://127.0.0.1:9871";
  }
  if (!fault && local_endpoint == endpoint && !endpoint.ends_with(":*")) {
    fault = "is /publish/endpoint too; give it another port or file, or leave it out";
  }
  if (!fault) return std::nullopt;
  return OptionFault{"/local_endpoint", "\"" + local_endpoint + "\" " + *fault};
}

void ControlOptions::describe(OptionVisitor& visitor) {
  visitor.text("endpoint", endpoint,
               "endpoint for splid ctl: ipc:///PATH, a socket for its owner only, or "
               "tcp://HOST:PORT with allow_list; auto: /run/splid/control.sock for the service, "
               "see docs/guide/control.md; off: none");
  visitor.path("allow_list", allow_list,
               "for tcp://: file of the public keys that may control, a line each: KEY name; read "
               "again on SIGHUP; needs security.server_key");
}

std::optional<OptionFault> ControlOptions::validate() const {
  if (const std::optional<std::string> fault = control_fault(endpoint)) {
    return OptionFault{"/endpoint", "\"" + endpoint + "\" " + *fault};
  }
  if (is_tcp() && allow_list.empty()) {
    return OptionFault{"/allow_list",
                       "\"\" names no file, and /control/endpoint is a port, which everybody who "
                       "reaches it could start and stop the instrument by; write the public keys "
                       "that may into a file and name it here, or give a file as endpoint, as in "
                       "ipc:///run/splid/control.sock"};
  }
  if (!is_tcp() && !allow_list.empty()) {
    return OptionFault{"/allow_list",
                       "is for tcp://; at a file, its owner alone may ask: remove it"};
  }
  return std::nullopt;
}

void MetricsOptions::describe(OptionVisitor& visitor) {
  visitor.path(
      "file", file,
      "file for node_exporter's textfile collector, written once a second; its name ends in .prom");
  visitor.text("http", http,
               "address of /metrics for Prometheus, on this machine only, such as 127.0.0.1:9873; "
               "empty: none");
}

std::optional<OptionFault> MetricsOptions::validate() const {
  if (http.empty()) return std::nullopt;
  std::optional<std::string> fault = local_address_fault(http, "127.0.0.1:9873");
  // Debian builds the HTTP server's library without IPv6.
  if (!fault && !is_ipv4_loopback(std::string_view(http).substr(0, http.rfind(':')))) {
    fault = "is no IPv4 address; write it as in 127.0.0.1:9873";
  }
  if (!fault) return std::nullopt;
  return OptionFault{"/http", "\"" + http + "\" " + *fault};
}

}  // namespace splid
