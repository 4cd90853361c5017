#include "daemon/output/http_exchange.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <string_view>
#include <utility>

namespace splid {
namespace {

// A scrape sends its request at once, and takes the answer.
constexpr std::int64_t request_patience_ns = 1'000'000'000;
constexpr std::int64_t answer_patience_ns = 5'000'000'000;

constexpr std::size_t longest_request = 8192;

std::string answer(const char* status, const char* type, const std::string& body, bool with_body) {
  return std::string("HTTP/1.1 ") + status + "\r\nContent-Type: " + type +
         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" +
         (with_body ? body : "");
}

std::string answer_to(std::string_view request, const std::function<std::string()>& text) {
  constexpr const char* plain = "text/plain; charset=utf-8";
  const std::string_view line = request.substr(0, request.find_first_of("\r\n"));
  const std::size_t space = line.find(' ');
  const std::string_view method = line.substr(0, space);
  std::string_view target = space == std::string_view::npos ? "" : line.substr(space + 1);
  target = target.substr(0, target.find_first_of(" ?"));
  if (method != "GET" && method != "HEAD") {
    return answer("405 Method Not Allowed", plain, "GET /metrics\n", true);
  }
  const bool with_body = method == "GET";
  if (target != "/metrics") {
    return answer("404 Not Found", plain, "the metrics are at /metrics\n", with_body);
  }
  return answer("200 OK", "text/plain; version=0.0.4; charset=utf-8", text(), with_body);
}

bool is_for_later(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

HttpExchange::HttpExchange(FileDescriptor socket, sockets::Peer peer, std::int64_t now_ns)
    : socket_(std::move(socket)), peer_(std::move(peer)), end_ns_(now_ns + request_patience_ns) {}

bool HttpExchange::go_on(const std::function<std::string()>& text, std::int64_t now_ns) {
  if (!answers() && !read(text, now_ns)) return false;
  if (answers() && !write()) return false;
  return now_ns < end_ns_;
}

bool HttpExchange::read(const std::function<std::string()>& text, std::int64_t now_ns) {
  std::array<char, 4096> some{};
  const ssize_t got = ::recv(socket_.get(), some.data(), some.size(), MSG_DONTWAIT);
  if (got < 0 && is_for_later(errno)) return true;
  if (got <= 0) return false;
  request_.append(some.data(), static_cast<std::size_t>(got));
  if (request_.size() > longest_request) return false;
  if (request_.find("\r\n\r\n") == std::string::npos &&
      request_.find("\n\n") == std::string::npos) {
    return true;
  }
  answer_ = answer_to(request_, text);
  end_ns_ = now_ns + answer_patience_ns;
  return true;
}

// False: all is sent, or cannot be.
bool HttpExchange::write() {
  while (sent_ < answer_.size()) {
    const ssize_t done = ::send(socket_.get(), answer_.data() + sent_, answer_.size() - sent_,
                                MSG_NOSIGNAL | MSG_DONTWAIT);
    if (done < 0 && is_for_later(errno)) return true;
    if (done < 0) return false;
    sent_ += static_cast<std::size_t>(done);
  }
  ::shutdown(socket_.get(), SHUT_WR);
  return false;
}

}  // namespace splid
