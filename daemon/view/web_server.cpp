#include "daemon/view/web_server.hpp"

#include <fcntl.h>
#include <microhttpd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "config/endpoint.hpp"
#include "daemon/base/log.hpp"
#include "daemon/sockets/listening_socket.hpp"
#include "daemon/sockets/peer.hpp"
#include "daemon/view/page_asset.hpp"
#include "daemon/view/request_check.hpp"
#include "protocol/error.hpp"

namespace splid::view {
namespace {

constexpr std::size_t connection_bytes = 24U << 10U;  // headers of the request and its answer
constexpr unsigned patience_s = 15;                   // for a connection on which nothing moves
constexpr std::size_t block_bytes = 16U << 10U;       // of events that are sent at once
// What the system keeps for a viewer that does not read, which it doubles. By itself it would keep
// up to 4 MiB: a minute of old news and more, which a viewer that wakes up has to read first.
constexpr int unread_bytes = 128 << 10;
constexpr std::int64_t heartbeat_ns = 5'000'000'000;
constexpr std::int64_t default_window_s = 60;
constexpr std::size_t longest_pixel = 32;  // bytes of a name, in a configuration

// What a browser lets the page do: load its own files and listen to its own server, nothing else,
// and be shown in no other page.
constexpr const char* content_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string machine_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return {};
  return name.data();
}

std::string_view header(MHD_Connection* connection, const char* name) {
  const char* value = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  return value == nullptr ? "" : value;
}

// Of the query; empty where it has none of that name.
std::string_view argument(MHD_Connection* connection, const char* name) {
  const char* value = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, name);
  return value == nullptr ? "" : value;
}

bool has_header(MHD_Connection* connection, const char* name) {
  return MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name) != nullptr;
}

MHD_Result add_line(void* bytes, MHD_ValueKind /*kind*/, const char* name, const char* value) {
  const std::size_t value_bytes = value == nullptr ? 0 : std::strlen(value);
  *static_cast<std::size_t*>(bytes) += std::strlen(name) + std::strlen(": \r\n") + value_bytes;
  return MHD_YES;
}

// Whether libmicrohttpd has handed over less than it was sent: before 1.0 it cuts a header at a
// null character, and takes "localhost\0.evil" for localhost. Clients write "Name: value"; a
// header with more spaces counts as cut, too.
bool is_cut(MHD_Connection* connection, std::size_t request_line_bytes) {
  std::size_t bytes = request_line_bytes + std::strlen("\r\n\r\n");
  MHD_get_connection_values(connection, MHD_HEADER_KIND, &add_line, &bytes);
  return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE)->header_size >
         bytes;
}

bool is_reading(std::string_view method) { return method == "GET" || method == "HEAD"; }

void add_headers(MHD_Response* response, const char* type) {
  for (const auto& [name, value] : {std::pair{"Content-Type", type},
                                    {"Content-Security-Policy", content_policy},
                                    {"X-Content-Type-Options", "nosniff"},
                                    {"Referrer-Policy", "no-referrer"},
                                    {"Cross-Origin-Opener-Policy", "same-origin"},
                                    {"Cross-Origin-Resource-Policy", "same-origin"},
                                    {"Cache-Control", "no-store"}}) {
    MHD_add_response_header(response, name, value);
  }
}

int send(MHD_Connection* connection, unsigned code, MHD_Response* response) {
  const int done = MHD_queue_response(connection, code, response);
  MHD_destroy_response(response);
  return done;
}

}  // namespace

// A browser's connection, for one request after the other.
struct WebServer::Connection {
  int socket;
  std::string group;          // of its peer
  std::int64_t until_ns;      // when it is closed; never: an event stream
  std::size_t uri_bytes = 0;  // of the request, before libmicrohttpd decodes it
  static constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();
};

// One page that listens. Lives until libmicrohttpd lets go of its answer.
struct WebServer::Viewer {
  WebServer* server;
  MHD_Connection* connection;
  std::string group;  // of its peer
  LiveView::Cursor cursor;
  std::string outgoing;  // composed, and sent up to `sent`
  std::size_t sent = 0;
  std::int64_t told_ns = 0;  // when it was last composed
  bool suspended = false;    // nothing to send: libmicrohttpd does not look at it
};

// Functions in C's manner, which hand on to the server that they are given.
struct WebServer::Callbacks {
  static MHD_Result may_connect(void* server, const sockaddr* /*peer*/, socklen_t /*size*/) {
    auto* self = static_cast<WebServer*>(server);
    if (self->connections_.size() < most_connections) return MHD_YES;
    ++self->refused_;
    return MHD_NO;
  }

  static void notify(void* server, MHD_Connection* connection, void** context,
                     MHD_ConnectionNotificationCode code) {
    auto* self = static_cast<WebServer*>(server);
    if (code == MHD_CONNECTION_NOTIFY_STARTED) self->connected(connection, context);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) self->disconnected(*context);
  }

  // An answer was taken, or its connection is lost.
  static void completed(void* server, MHD_Connection* connection, void** /*request*/,
                        MHD_RequestTerminationCode /*how*/) {
    const auto* self = static_cast<const WebServer*>(server);
    known(connection).until_ns = self->clock_.steady_ns() + request_ns;
  }

  static Connection& known(MHD_Connection* connection) {
    const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return *static_cast<Connection*>(info->socket_context);
  }

  // Called once for a request, with its address as it came.
  static void* begin_request(void* /*server*/, const char* uri, MHD_Connection* connection) {
    known(connection).uri_bytes = std::strlen(uri);
    return nullptr;
  }

  // Called twice for a request: with its headers, and when it is whole. One that is answered at the
  // first call costs its connection, which is right for those that bring a body.
  static MHD_Result handle(void* server, MHD_Connection* connection, const char* url,
                           const char* method, const char* version, const char* /*body*/,
                           std::size_t* /*body_bytes*/, void** request) {
    auto* self = static_cast<WebServer*>(server);
    const bool reads = is_reading(method);
    if (reads && *request == nullptr) {
      *request = self;
      return MHD_YES;
    }
    const std::size_t line_bytes =
        std::strlen(method) + known(connection).uri_bytes + std::strlen(version) + 2;
    if (is_cut(connection, line_bytes)) {
      return self->refuse(connection, MHD_HTTP_BAD_REQUEST,
                          "the request has a null character, or more than one space after a "
                          "header's colon") == MHD_YES
                 ? MHD_YES
                 : MHD_NO;
    }
    return self->answer(connection, url, method) == MHD_YES ? MHD_YES : MHD_NO;
  }

  static ssize_t read_events(void* viewer, std::uint64_t /*position*/, char* to, std::size_t room) {
    auto* self = static_cast<Viewer*>(viewer);
    const WebServer& server = *self->server;
    if (self->sent == self->outgoing.size() && server.is_due(*self)) {
      self->told_ns = server.clock_.steady_ns();
      self->outgoing = server.view_.news(self->cursor);
      if (self->outgoing.empty()) self->outgoing = ":\n\n";  // a heartbeat
      self->sent = 0;
    }
    const std::size_t count = std::min(room, self->outgoing.size() - self->sent);
    if (count == 0) {
      self->suspended = true;
      MHD_suspend_connection(self->connection);
      return 0;
    }
    std::copy_n(self->outgoing.data() + self->sent, count, to);
    self->sent += count;
    return static_cast<ssize_t>(count);
  }

  static void forget(void* viewer) {
    auto* self = static_cast<Viewer*>(viewer);
    self->server->viewers_.remove_if([&](const auto& one) { return one.get() == self; });
  }
};

WebServer::WebServer(const std::string& address, LiveView& view, const Clock& clock)
    : view_(view), clock_(clock), machine_name_(machine_name()) {
  if (const auto fault = http_address_fault(address, "127.0.0.1:9874")) {
    throw Error(Fault::usage, "--http " + address + ": " + *fault);
  }
  const sockets::ListeningSocket listener("--http", "tcp://" + address, address);
  constexpr std::size_t scheme_bytes = 6;  // tcp://
  place_ = listener.endpoint().substr(scheme_bytes);
  // libmicrohttpd closes the socket that it is given.
  const int socket = ::fcntl(listener.get(), F_DUPFD_CLOEXEC, 0);
  // Connections inherit it.
  ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &unread_bytes, sizeof unread_bytes);
  daemon_ = MHD_start_daemon(
      MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME, 0, &Callbacks::may_connect, this,
      &Callbacks::handle, this, MHD_OPTION_LISTEN_SOCKET, socket, MHD_OPTION_CONNECTION_LIMIT,
      most_connections + 1, MHD_OPTION_CONNECTION_MEMORY_LIMIT, connection_bytes,
      MHD_OPTION_CONNECTION_TIMEOUT, patience_s, MHD_OPTION_NOTIFY_CONNECTION, &Callbacks::notify,
      this, MHD_OPTION_NOTIFY_COMPLETED, &Callbacks::completed, this, MHD_OPTION_URI_LOG_CALLBACK,
      &Callbacks::begin_request, this, MHD_OPTION_END);
  if (daemon_ == nullptr) {
    throw Error(Fault::device, "--http " + address + ": libmicrohttpd cannot serve there");
  }
  descriptor_ = MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
}

WebServer::~WebServer() {
  // libmicrohttpd's daemon may only be stopped while no connection is suspended.
  for (const auto& viewer : viewers_) {
    if (viewer->suspended) MHD_resume_connection(viewer->connection);
    viewer->suspended = false;
  }
  MHD_stop_daemon(daemon_);
}

std::string WebServer::url() const { return "http://" + place_ + "/"; }

bool WebServer::is_due(const Viewer& viewer) const {
  const std::int64_t silent_ns = clock_.steady_ns() - viewer.told_ns;
  if (viewer.told_ns == 0 || silent_ns >= heartbeat_ns) return true;
  return silent_ns >= between_news_ns && view_.has_news(viewer.cursor);
}

std::chrono::milliseconds WebServer::patience() const {
  constexpr std::int64_t longest_ms = 100;
  std::int64_t least_ms = longest_ms;
  const std::int64_t now_ns = clock_.steady_ns();
  for (const auto& viewer : viewers_) {
    if (!view_.has_news(viewer->cursor)) continue;
    const std::int64_t left_ns = viewer->told_ns + between_news_ns - now_ns;
    least_ms = std::clamp<std::int64_t>(left_ns / 1'000'000 + 1, 0, least_ms);
  }
  MHD_UNSIGNED_LONG_LONG own_ms = 0;
  if (MHD_get_timeout(daemon_, &own_ms) == MHD_YES) {
    least_ms = std::min(least_ms, static_cast<std::int64_t>(std::min<std::uint64_t>(
                                      own_ms, static_cast<std::uint64_t>(longest_ms))));
  }
  return std::chrono::milliseconds{least_ms};
}

bool WebServer::fold_is_wanted() const {
  return std::any_of(viewers_.begin(), viewers_.end(),
                     [](const auto& viewer) { return viewer->cursor.wants_fold; });
}

void WebServer::run() {
  for (const auto& viewer : viewers_) {
    if (!viewer->suspended || !is_due(*viewer)) continue;
    viewer->suspended = false;
    MHD_resume_connection(viewer->connection);
  }
  close_late();
  MHD_run(daemon_);
}

void WebServer::connected(MHD_Connection* connection, void** context) {
  const int socket =
      MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
  std::string group = sockets::peer_of(socket).group;
  const auto of_peer = std::count_if(connections_.begin(), connections_.end(),
                                     [&](const auto& one) { return one->group == group; });
  connections_.push_back(std::make_unique<Connection>(
      Connection{socket, std::move(group), clock_.steady_ns() + request_ns}));
  *context = connections_.back().get();
  if (static_cast<std::size_t>(of_peer) < most_connections_a_peer) return;
  ++refused_;
  ::shutdown(socket, SHUT_RDWR);
}

void WebServer::disconnected(const void* context) {
  connections_.remove_if([&](const auto& one) { return one.get() == context; });
}

// libmicrohttpd lets go of a connection that was shut down.
void WebServer::close_late() const {
  const std::int64_t now_ns = clock_.steady_ns();
  for (const auto& connection : connections_) {
    if (now_ns < connection->until_ns) continue;
    ::shutdown(connection->socket, SHUT_RDWR);
    connection->until_ns = Connection::never;
  }
}

int WebServer::refuse(MHD_Connection* connection, unsigned code, const std::string& why) {
  // The first of many is enough in the log; the page shows the count.
  if (refused_++ == 0) log_warning("refused a request for the page: {}", why);
  const std::string text = why + "\n";
  MHD_Response* response = MHD_create_response_from_buffer(
      text.size(), const_cast<char*>(text.data()), MHD_RESPMEM_MUST_COPY);
  add_headers(response, "text/plain; charset=utf-8");
  if (code == MHD_HTTP_METHOD_NOT_ALLOWED) MHD_add_response_header(response, "Allow", "GET, HEAD");
  MHD_add_response_header(response, "Connection", "close");
  return send(connection, code, response);
}

int WebServer::answer(MHD_Connection* connection, std::string_view path, std::string_view method) {
  Callbacks::known(connection).until_ns = clock_.steady_ns() + answer_ns;
  const std::string_view host = header(connection, "Host");
  if (!is_own_host(host, machine_name_)) {
    return refuse(connection, MHD_HTTP_FORBIDDEN,
                  "the request names another host than this machine; ask for the page by the "
                  "machine's address, by localhost or by its own name");
  }
  if (has_header(connection, "Origin") && !is_own_origin(header(connection, "Origin"), host)) {
    return refuse(connection, MHD_HTTP_FORBIDDEN, "the request comes from another site's page");
  }
  if (!is_reading(method)) {
    return refuse(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "the page is for reading: GET or HEAD");
  }
  if (path == "/events") return serve_events(connection);
  if (path == "/frames.csv") return serve_frames(connection);
  const PageAsset* asset = path.starts_with('/') ? find_asset(path.substr(1)) : nullptr;
  if (asset == nullptr) {
    return refuse(connection, MHD_HTTP_NOT_FOUND, "there is no such file; the page is at /");
  }
  MHD_Response* response = MHD_create_response_from_buffer(
      asset->size, const_cast<unsigned char*>(asset->bytes), MHD_RESPMEM_PERSISTENT);
  add_headers(response, asset->type);
  MHD_add_response_header(response, "Content-Encoding", "gzip");
  return send(connection, MHD_HTTP_OK, response);
}

// The page makes a table of what it draws where frames of that time are no longer kept (204).
int WebServer::serve_frames(MHD_Connection* connection) {
  const auto from_s = time_from(argument(connection, "from"));
  const auto to_s = time_from(argument(connection, "to"));
  if (!from_s || !to_s) {
    return refuse(connection, MHD_HTTP_BAD_REQUEST,
                  "frames.csv?from=SECONDS&to=SECONDS, both since 1970");
  }
  const auto csv = view_.frames_csv(std::string(argument(connection, "pixel")), *from_s, *to_s);
  std::string text = csv.value_or("");
  MHD_Response* response =
      MHD_create_response_from_buffer(text.size(), text.data(), MHD_RESPMEM_MUST_COPY);
  add_headers(response, "text/csv; charset=utf-8");
  return send(connection, csv ? MHD_HTTP_OK : MHD_HTTP_NO_CONTENT, response);
}

int WebServer::serve_events(MHD_Connection* connection) {
  Connection& place = Callbacks::known(connection);
  const auto of_peer = std::count_if(viewers_.begin(), viewers_.end(), [&](const auto& viewer) {
    return viewer->group == place.group;
  });
  if (viewers_.size() >= most_viewers || static_cast<std::size_t>(of_peer) >= most_viewers_a_peer) {
    return refuse(connection, MHD_HTTP_SERVICE_UNAVAILABLE,
                  "there are as many viewers as there may be; close another page");
  }
  const auto seconds = seconds_from(argument(connection, "seconds"));
  LiveView::Cursor cursor = LiveView::cursor(seconds.value_or(default_window_s));
  cursor.wants_fold = argument(connection, "fold") == "1";
  const std::string_view pixel = argument(connection, "pixel");
  if (!pixel.empty() && pixel.size() <= longest_pixel) view_.look_at(std::string(pixel), cursor);
  place.until_ns = Connection::never;
  viewers_.push_back(std::make_unique<Viewer>(
      Viewer{this, connection, place.group, std::move(cursor), {}, 0, 0, false}));
  MHD_Response* response =
      MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, block_bytes, &Callbacks::read_events,
                                        viewers_.back().get(), &Callbacks::forget);
  add_headers(response, "text/event-stream; charset=utf-8");
  return send(connection, MHD_HTTP_OK, response);
}

}  // namespace splid::view
