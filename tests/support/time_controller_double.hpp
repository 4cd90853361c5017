#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

namespace splid::test {

// A Time Controller of ID Quantique's and the maker's data link program, at ZeroMQ sockets of this
// machine. It knows the commands that splid sends and no others, and refuses what the real ones
// refuse: settings while it measures, sub-acquisitions below 200 ms or less than 40 ns apart, and
// streams of another instrument, of an input that has one, or of no input.
class TimeControllerDouble {
 public:
  // Times of an input in [begin_ps, end_ps) of the measurement's clock, sorted.
  using Events = std::function<std::vector<std::int64_t>(int input, std::int64_t begin_ps,
                                                         std::int64_t end_ps)>;
  using Clock = std::chrono::steady_clock;

  // What goes wrong.
  struct Faults {
    std::atomic<bool> instrument_is_gone{false};
    std::atomic<bool> program_is_gone{false};
    std::atomic<bool> is_older{false};  // does not know REC:PWID
    std::atomic<bool> refuses_streams{false};
    std::atomic<bool> is_silent{false};   // no sub-acquisition ends
    std::atomic<bool> is_stopped{false};  // once
    std::atomic<int> drops{0};            // so many messages are counted and not sent
    std::atomic<int> garbage{0};          // so many messages are garbage
    std::atomic<std::int64_t> errors{0};  // of each input
  };

  // speed: of its clock.
  explicit TimeControllerDouble(Events events, double speed = 1)
      : events_(std::move(events)), speed_(speed) {
    const int first = free_ports(most_inputs + 3);
    instrument_place_ = "127.0.0.1:" + std::to_string(first);
    program_place_ = "127.0.0.1:" + std::to_string(first + 1);
    stream_port_ = first + 1;  // input 1 is on the next
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }
  ~TimeControllerDouble() { thread_ = {}; }
  TimeControllerDouble(const TimeControllerDouble&) = delete;
  TimeControllerDouble& operator=(const TimeControllerDouble&) = delete;

  [[nodiscard]] std::string address() const { return "tcp:" + instrument_place_; }
  [[nodiscard]] std::string data_link() const { return "tcp:" + program_place_; }
  [[nodiscard]] int stream_port() const { return stream_port_; }
  // Each command of a measurement and each request to the program, a line each, but for questions.
  [[nodiscard]] std::string log() const {
    const std::lock_guard lock(mutex_);
    return log_;
  }
  [[nodiscard]] int plays() const { return plays_; }
  // When the measurement began.
  [[nodiscard]] Clock::time_point played() const {
    const std::lock_guard lock(mutex_);
    return played_;
  }

  Faults faults;

 private:
  static constexpr int most_inputs = 4;

  struct Stream {
    int port = 0;
    std::optional<zmq::socket_t> socket;
    std::int64_t acquisitions = 0;
    std::uint64_t times = 0;
  };

  static int free_ports(int count) {
    std::random_device device;
    std::mt19937 random(device());
    while (true) {
      const int first = std::uniform_int_distribution<int>(20'000, 30'000)(random);
      bool are_free = true;
      for (int port = first; port < first + count && are_free; ++port) {
        const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in place{};
        place.sin_family = AF_INET;
        place.sin_port = htons(static_cast<std::uint16_t>(port));
        place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        are_free = ::bind(descriptor, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0;
        ::close(descriptor);
      }
      if (are_free) return first;
    }
  }

  void serve(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      keep(instrument_, instrument_place_, faults.instrument_is_gone);
      keep(program_, program_place_, faults.program_is_gone);
      if (!program_) streams_.clear();
      if (!instrument_) is_playing_ = false;
      answer(instrument_, [this](const std::string& text) { return obey(text); });
      answer(program_, [this](const std::string& text) { return link(text); });
      if (faults.is_stopped.exchange(false)) is_playing_ = false;
      if (is_playing_) end_sub_acquisitions();
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
  }

  // Opens the socket, or closes it where it is to be gone.
  void keep(std::optional<zmq::socket_t>& socket, const std::string& place, bool is_gone) {
    if (is_gone) socket.reset();
    if (is_gone || socket) return;
    socket.emplace(context_, zmq::socket_type::rep);
    socket->set(zmq::sockopt::linger, 0);
    try {
      socket->bind("tcp://" + place);
    } catch (const zmq::error_t&) {
      socket.reset();  // that of before is not closed yet
    }
  }

  static void answer(std::optional<zmq::socket_t>& socket,
                     const std::function<std::string(const std::string&)>& reply) {
    zmq::message_t message;
    while (socket && socket->recv(message, zmq::recv_flags::dontwait)) {
      (void)socket->send(zmq::buffer(reply(message.to_string())), zmq::send_flags::none);
    }
  }

  void note(const std::string& line) {
    const std::lock_guard lock(mutex_);
    log_ += line + '\n';
  }

  // Commands of the instrument, and what follows them.
  std::string obey(const std::string& text) {
    if (text == "*IDN?") return "IDQ ID1000 double\n";
    if (text == "REC:STAGe?") return is_playing_ ? "PLAYING" : "STOPPED";
    if (text.ends_with(":ERRORS?")) return std::to_string(faults.errors);
    note(text);
    if (text == "REC:STOP") return std::exchange(is_playing_, false) ? "stopped" : "SCPI_ERR_EXEC";
    if (is_playing_) return "SCPI_ERR_EXEC: it measures";
    if (text.starts_with("REC:PWID ")) return set_width(text);
    if (text == "REC:PLAY") return play();
    static const std::set<std::string> known = {
        "DEVI:SYNC",         "DEVI:RES",   "INPU#:COUP",        "INPU#:EDGE",     "INPU#:THRE",
        "INPU#:SELE",        "INPU#:ENAB", "DELA#:LINK",        "DELA#:VALU",     "TSCO#:FIR:LINK",
        "TSCO#:OPIN",        "TSCO#:OPOU", "TSCO#:WIND:ENAB",   "RAW#:STOP:LINK", "RAW#:REF:LINK",
        "RAW#:ERRORS:CLEAR", "RAW#:SEND",  "REC:TRIG:ARM:MODE", "REC:ENABle",     "REC:NUM"};
    std::string head = text.substr(0, text.find(' '));
    for (char& letter : head) {
      if (letter >= '1' && letter <= '8') letter = '#';
    }
    if (!known.contains(head)) return "SCPI_ERR_INVALID_CMD";
    if (head == "RAW#:SEND") sends_[text[3] - '0'] = text.ends_with("ON");
    return "Value set to " + text.substr(std::min(text.find(' '), text.size() - 1) + 1);
  }

  std::string set_width(const std::string& text) {
    constexpr std::int64_t least_width_ps = 200'000'000'000;
    constexpr std::int64_t least_dead_ps = 40'000;
    if (faults.is_older) return "SCPI_ERR_INVALID_CMD";
    long long width = 0;
    long long period = 0;
    if (std::sscanf(text.c_str(), "REC:PWID %lld;PPER %lld", &width, &period) != 2) {
      return "SCPI_ERR_PARAM_TYPE";
    }
    if (width < least_width_ps || period - width < least_dead_ps) return "SCPI_ERR_PARAM_TYPE";
    width_ps_ = width;
    period_ps_ = period;
    return "Value set to " + std::to_string(period);
  }

  std::string play() {
    if (width_ps_ == 0) return "SCPI_ERR_EXEC: it has no width";
    is_playing_ = true;
    index_ = 0;
    const std::lock_guard lock(mutex_);
    played_ = Clock::now();
    ++plays_;
    return "playing";
  }

  // Requests to the data link program.
  std::string link(const std::string& text) {
    std::istringstream words(text);
    std::string verb;
    words >> verb;
    std::map<std::string, std::string> options;
    for (std::string key, value; words >> key >> value;) options[key] = value;
    if (verb == "status") return status(options["--id"]);
    note(text);
    if (verb == "list") return list();
    if (verb == "start-stream") return start_stream(options);
    if (verb == "stop" && streams_.erase(options["--id"]) > 0) return R"({"status":{}})";
    return refusal("unknown: " + text);
  }

  static std::string refusal(const std::string& why) {
    return R"({"error":{"description":")" + why + R"("}})";
  }

  std::string list() const {
    std::string ids;
    for (const auto& [id, stream] : streams_) ids += (ids.empty() ? "\"" : ",\"") + id + '"';
    return "[" + ids + "]";
  }

  std::string status(const std::string& id) const {
    const auto found = streams_.find(id);
    if (found == streams_.end()) return refusal("no acquisition " + id);
    return R"({"acquisitions_count":)" + std::to_string(found->second.acquisitions) +
           R"(,"timestamps_count":)" + std::to_string(found->second.times) +
           R"(,"inactivity":0.1,"errors":[]})";
  }

  std::string start_stream(std::map<std::string, std::string>& options) {
    const int input = std::atoi(options["--channel"].c_str());
    const std::string id = options["--address"] + ":" + std::to_string(5555 + input);
    if (faults.refuses_streams) return refusal("the port is used by another program");
    if (!instrument_place_.starts_with(options["--address"] + ":")) return refusal("no instrument");
    if (input < 1 || input > most_inputs) return refusal("no channel");
    if (streams_.contains(id)) return refusal("the channel has a stream");
    Stream& stream = streams_[id];
    stream.port = std::atoi(options["--stream-port"].c_str());
    stream.socket.emplace(context_, zmq::socket_type::pair);
    stream.socket->set(zmq::sockopt::linger, 0);
    // A stream of before that was stopped leaves its port a little later.
    for (int i = 0; i < 1000; ++i) {
      try {
        stream.socket->bind("tcp://127.0.0.1:" + std::to_string(stream.port));
        return R"({"id":")" + id + "\"}";
      } catch (const zmq::error_t&) {
        std::this_thread::sleep_for(std::chrono::milliseconds{1});
      }
    }
    streams_.erase(id);
    return refusal("the port is in use");
  }

  // Those whose time is over by now.
  void end_sub_acquisitions() {
    const auto since = std::chrono::duration<double>(Clock::now() - played_).count();
    const auto now_ps = static_cast<std::int64_t>(since * speed_ * 1e12);
    for (; now_ps >= (index_ + 1) * period_ps_ && !faults.is_silent; ++index_) {
      const std::int64_t begin_ps = index_ * period_ps_;
      for (auto& [id, stream] : streams_) send_times(id.back() - '5', stream, begin_ps);
    }
  }

  void send_times(int input, Stream& stream, std::int64_t begin_ps) {
    ++stream.acquisitions;
    if (!sends_[input]) return;
    std::vector<std::int64_t> times = events_(input, begin_ps, begin_ps + width_ps_);
    for (std::int64_t& time : times) time -= begin_ps;
    stream.times += times.size();
    if (times.empty() || take_one(faults.drops)) return;
    if (take_one(faults.garbage)) times.front() = -1;
    (void)stream.socket->send(zmq::buffer(times), zmq::send_flags::dontwait);
  }

  static bool take_one(std::atomic<int>& left) {
    if (left == 0) return false;
    --left;
    return true;
  }

  Events events_;
  double speed_;
  zmq::context_t context_{1};
  std::string instrument_place_;
  std::string program_place_;
  int stream_port_ = 0;
  std::atomic<int> plays_{0};
  mutable std::mutex mutex_;
  std::string log_;
  Clock::time_point played_;

  // The serving thread's.
  std::optional<zmq::socket_t> instrument_;
  std::optional<zmq::socket_t> program_;
  std::map<std::string, Stream> streams_;  // by id
  std::map<int, bool> sends_;              // by input
  bool is_playing_ = false;
  std::int64_t width_ps_ = 0;
  std::int64_t period_ps_ = 0;
  std::int64_t index_ = 0;  // of the sub-acquisition that goes on
  std::jthread thread_;
};

}  // namespace splid::test
