#include "daemon/service/control/control_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/security/refusals.hpp"
#include "daemon/service/control/control_client.hpp"
#include "tests/support/control_peer.hpp"
#include "tests/support/temp_folder.hpp"

namespace splid::control {
namespace {

using std::chrono::milliseconds;
using test::ControlPeer;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* status_request = R"({"schema":"splid.control","request":"status"})";
constexpr const char* stop_request = R"({"schema":"splid.control","request":"stop"})";

// A server whose upload takes until it is let go or asked to stop, and whose rest is done at once.
class ServedRequests : public ::testing::Test {
 protected:
  ServedRequests() {
    Handlers handlers;
    handlers.status = [](const std::string& doing) {
      return Reply{"status", {}, "doing " + doing};
    };
    handlers.perform = [this](const Request& request, const std::stop_token& stop) {
      return perform(request, stop);
    };
    server = std::make_unique<Server>(endpoint, std::move(handlers), nullptr, refusals);
  }

  Reply perform(const Request& request, const std::stop_token& stop) {
    ++performed;
    if (request.command == Command::start) throw Error(Fault::data, "not today");
    if (request.command == Command::record_start) throw std::bad_alloc();
    while (request.command == Command::upload && !let_go) {
      if (stop.stop_requested()) throw Error(Fault::usage, "stopped");
      std::this_thread::sleep_for(milliseconds{1});
    }
    return {to_string(request.command), {}, "done"};
  }

  Reply ask(Command command, const std::stop_token& stop = {}) const {
    Request request;
    request.command = command;
    return Client(endpoint, std::nullopt)
        .ask(
            request, [](const Reply&) {}, stop);
  }

  test::TempFolder folder;
  std::string endpoint = "ipc://" + folder.path("control");
  security::Refusals refusals{[](const std::string&) {}, host_clock()};
  std::atomic<bool> let_go{false};
  std::atomic<int> performed{0};
  std::unique_ptr<Server> server;
};

TEST_F(ServedRequests, AnErrorIsAReply) {
  EXPECT_EQ(ask(Command::stop).message, "done");
  const Reply refused = ask(Command::start);
  EXPECT_EQ(refused.fault, Fault::data);
  EXPECT_EQ(refused.message, "not today");
  EXPECT_EQ(refused.request, "start");
  EXPECT_EQ(ask(Command::record_start).fault, Fault::device);
  EXPECT_EQ(ask(Command::stop).message, "done");
}

TEST_F(ServedRequests, DoesOneThingAtATimeAndAnswersStatusMeanwhile) {
  ControlPeer slow(endpoint);
  slow.send({R"({"schema":"splid.control","request":"upload"})"});
  ControlPeer other(endpoint, zmq::socket_type::req);
  while (other.ask(status_request).find("doing upload") == std::string::npos) {
  }
  EXPECT_THAT(other.ask(stop_request),
              AllOf(HasSubstr("busy: upload is running"), HasSubstr(R"("fault":"device")")));
  let_go = true;
  EXPECT_THAT(slow.receive(), HasSubstr(R"("request":"upload","ok":true)"));
  EXPECT_EQ(performed, 1);
  EXPECT_THAT(other.ask(stop_request), HasSubstr(R"("ok":true)"));
}

TEST_F(ServedRequests, ItsEndStopsWhatRunsAndSaysSo) {
  ControlPeer slow(endpoint);
  slow.send({R"({"schema":"splid.control","request":"upload"})"});
  while (performed == 0) std::this_thread::sleep_for(milliseconds{1});
  server.reset();
  EXPECT_THAT(slow.receive(), HasSubstr(R"("error":"stopped")"));
}

TEST_F(ServedRequests, AnswersEachOfManyAndSurvivesThoseWhoLeave) {
  std::atomic<int> answered{0};
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < 8; ++i) {
      clients.emplace_back([&, i] {
        for (int k = 0; k < 20; ++k) {
          ControlPeer peer(endpoint);
          const std::string reply = peer.ask((i + k) % 2 == 0 ? status_request : stop_request);
          const bool busy = reply.find("busy: stop") != std::string::npos;
          answered += busy || reply.find(R"("ok":true)") != std::string::npos ? 1 : 0;
          peer.send({std::string(5000, 'x')});
          peer.send(std::vector<std::string>(50, stop_request));
        }
      });
    }
  }
  EXPECT_EQ(answered, 160);
  EXPECT_EQ(ask(Command::status).message, "doing ");
}

TEST_F(ServedRequests, AClientGivesUpWhenItIsToldTo) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW((void)ask(Command::upload, stop.get_token()), Error);
  server.reset();
  EXPECT_THROW((void)ask(Command::status), Error);
}

}  // namespace
}  // namespace splid::control
