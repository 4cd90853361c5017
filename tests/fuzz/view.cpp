#include "daemon/base/clock.hpp"
#include "daemon/view/live_view.hpp"
#include "daemon/view/request_check.hpp"
#include "tests/fuzz/fuzz.hpp"

// What the live page reads of strangers: the headers and the query of a request, and the messages
// that it is sent. Up to the first line feed the input is a header, and after that a message.

namespace splid::test::fuzz_view {
namespace {

void check_header(const std::string& text) {
  if (const auto host = view::host_of(text)) {
    must(!host->empty() && host->size() <= 253, "a host has a length");
    must(view::host_of(host->find(':') == std::string::npos ? *host : "[" + *host + "]") == host,
         "a host comes back");
  } else {
    must(!view::is_own_host(text, "lab"), "what is no host is not this one");
  }
  must(!view::is_own_origin(text, "127.0.0.1:9874") || text.find("//127.0.0.1:9874") != text.npos,
       "another origin is not the own one");
  if (const auto seconds = view::seconds_from(text)) {
    must(*seconds >= 0 && *seconds <= 99'999, "seconds are within their digits");
  }
}

void check_message(const std::string& text) {
  view::LiveView view(text, host_clock());
  view::LiveView::Cursor cursor = view::LiveView::cursor(10);
  cursor.wants_fold = text.size() % 2 == 0;
  view.look_at("a", cursor);
  for (const char* topic : {"frame", "scene", "frame/a", "fold", "status", "version", "other"}) {
    view.take(topic, text);
  }
  view.set_connection(text);
  const std::string news = view.news(cursor);
  must(!view.has_news(cursor), "a viewer has got all that there is");
  must(view.news(cursor).empty(), "and gets nothing twice");
  must(news.find('\r') == std::string::npos, "no carriage return gets through");
  // A line feed of the message would end its data and could begin an event of its own.
  for (std::size_t at = 0; (at = news.find('\n', at)) != std::string::npos; ++at) {
    const std::string_view rest = std::string_view(news).substr(at + 1);
    must(rest.empty() || rest.starts_with("event: ") || rest.starts_with("data: ") ||
             rest.starts_with('\n'),
         "each line is one that the view wrote");
  }
}

void check(const std::string& text) {
  const std::size_t end = text.find('\n');
  check_header(text.substr(0, end));
  if (end != std::string::npos) check_message(text.substr(end + 1));
}

}  // namespace
}  // namespace splid::test::fuzz_view

SPLID_FUZZ_TARGET(view) {
  splid::test::fuzz_view::check(splid::test::as_text(data, size));
  return 0;
}
