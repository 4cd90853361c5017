#include "config/daemon_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/endpoint.hpp"

namespace splid {
namespace {

using ::testing::HasSubstr;

std::string channel_fault(const ChannelOptions& options) {
  const auto fault = options.validate();
  return fault ? fault->pointer + ": " + fault->what : "";
}

std::string fault_of_endpoint(const std::string& endpoint) {
  const auto fault = PublishOptions{.endpoint = endpoint, .local_endpoint = ""}.validate();
  return fault ? fault->pointer + ": " + fault->what : "";
}

TEST(ChannelOptions, DefaultsAreValid) { EXPECT_EQ(channel_fault(ChannelOptions{}), ""); }

TEST(ChannelOptions, ATagMayHaveOneMeaning) {
  EXPECT_THAT(channel_fault({.photon = {"1", "2"}, .sync = "2"}),
              HasSubstr("/sync: \"2\" takes tags of \"2\", which is given at /photon/1"));
  EXPECT_THAT(channel_fault({.photon = {"1", "1"}}), HasSubstr("/photon/1"));
  EXPECT_THAT(channel_fault({.photon = {"1"}, .sync = "sync", .encoder = "1"}),
              HasSubstr("/encoder"));
  EXPECT_THAT(channel_fault({.sync = "marker:3", .encoder = "marker:1"}), HasSubstr("/encoder"));
  EXPECT_EQ(channel_fault({.sync = "marker:2", .encoder = "marker:1"}), "");
}

TEST(ChannelOptions, EncoderMayBeAbsentAndTheOthersNot) {
  EXPECT_EQ(channel_fault({.sync = "marker:1", .encoder = ""}), "");
  EXPECT_THAT(channel_fault({.sync = ""}), HasSubstr("/sync: \"\" is no channel"));
  EXPECT_THAT(channel_fault({.photon = {}}), HasSubstr("/photon: [] names no input"));
  EXPECT_THAT(channel_fault({.photon = {"0", "laser"}}), HasSubstr("/photon/1: \"laser\""));
}

TEST(ChannelOptions, DelaysAreOfInputsAndNotFarApart) {
  const auto fault = [](const std::vector<double>& delays_ps) {
    return channel_fault({.photon = {"1", "marker:2"}, .delays_ps = delays_ps});
  };
  EXPECT_EQ(fault({}), "");
  EXPECT_THAT(fault({0}), HasSubstr("/delays_ps: has 1 delays where /channels/photon has 2"));
  EXPECT_EQ(fault({0, 0}), "");
  for (const double delay_ps : {1, -1, 7}) {
    EXPECT_THAT(fault({0, delay_ps}), HasSubstr("/delays_ps/1: \"marker:2\" is no input"));
  }
  for (const double sign : {1, -1}) {  // from the syncs, which have none
    EXPECT_EQ(fault({sign * 500'000, 0}), "");
    EXPECT_THAT(fault({sign * 500'001, 0}), HasSubstr("/delays_ps: are more than 500000 ps apart"));
  }
}

TEST(PublishOptions, TakesLoopbackAndLocalSockets) {
  for (const char* endpoint :
       {"tcp://127.0.0.1:9872", "tcp://127.3.2.1:1", "tcp://localhost:65535", "tcp://[::1]:9872",
        "tcp://lo:9872", "tcp://127.0.0.1:*", "ipc:///run/splid/frames", "ipc://@splid"}) {
    EXPECT_EQ(fault_of_endpoint(endpoint), "") << endpoint;
  }
}

TEST(PublishOptions, TheLocalEndpointIsOnThisMachine) {
  const auto fault_of_local = [](const std::string& endpoint) {
    const auto fault = PublishOptions{.endpoint = "ipc://x", .local_endpoint = endpoint}.validate();
    return fault ? fault->pointer + ": " + fault->what : "";
  };
  for (const char* endpoint : {"", "tcp://127.0.0.1:9871", "ipc:///run/splid/frames"}) {
    EXPECT_EQ(fault_of_local(endpoint), "") << endpoint;
  }
  for (const char* endpoint : {"tcp://*:9871", "tcp://192.168.1.2:9871", "tcp://eth0:9871"}) {
    EXPECT_THAT(fault_of_local(endpoint), HasSubstr("/local_endpoint: \"tcp://")) << endpoint;
    EXPECT_THAT(fault_of_local(endpoint), HasSubstr("is not on this machine")) << endpoint;
  }
  EXPECT_THAT(fault_of_local("127.0.0.1:9871"), HasSubstr("must begin with tcp://"));
}

TEST(ControlOptions, IsAFileOrAPortWithAList) {
  const auto fault_of_control = [](const std::string& endpoint, const std::string& list = "") {
    const auto fault = ControlOptions{.endpoint = endpoint, .allow_list = list}.validate();
    return fault ? fault->pointer + ": " + fault->what : "";
  };
  for (const char* endpoint : {"auto", "off", "ipc:///run/splid/control.sock"}) {
    EXPECT_EQ(fault_of_control(endpoint), "") << endpoint;
    EXPECT_THAT(fault_of_control(endpoint, "list"), HasSubstr("/allow_list: is for tcp://"));
  }
  for (const char* endpoint : {"tcp://127.0.0.1:9874", "tcp://*:9874", "tcp://[::1]:9874"}) {
    EXPECT_EQ(fault_of_control(endpoint, "list"), "") << endpoint;
    EXPECT_THAT(fault_of_control(endpoint), HasSubstr("/allow_list: \"\" names no file"));
  }
  EXPECT_EQ(fault_of_control("ipc:///" + std::string(106, 'x')), "");
  EXPECT_THAT(fault_of_control("ipc:///" + std::string(107, 'x')), HasSubstr("108 bytes"));
  EXPECT_THAT(fault_of_control("tcp://127.0.0.1", "list"), HasSubstr("has no port"));
  for (const char* endpoint : {"", "on", "ipc://", "ipc://relative", "ipc://@abstract"}) {
    EXPECT_THAT(fault_of_control(endpoint), HasSubstr("/endpoint: ")) << endpoint;
    EXPECT_THAT(fault_of_control(endpoint), HasSubstr("must be auto, off, a file")) << endpoint;
  }
}

TEST(PublishOptions, RefusesWhatIsNoEndpoint) {
  EXPECT_THAT(fault_of_endpoint(""), HasSubstr("/endpoint: \"\" must begin with tcp://"));
  EXPECT_THAT(fault_of_endpoint("udp://127.0.0.1:1"), HasSubstr("must begin with"));
  EXPECT_THAT(fault_of_endpoint("tcp://127.0.0.1"), HasSubstr("has no port"));
  EXPECT_THAT(fault_of_endpoint("tcp://:9872"), HasSubstr("has no port"));
  EXPECT_THAT(fault_of_endpoint("tcp://127.0.0.1:0"), HasSubstr("port from 1 to 65535"));
  EXPECT_THAT(fault_of_endpoint("tcp://127.0.0.1:65536"), HasSubstr("port from 1 to 65535"));
  EXPECT_THAT(fault_of_endpoint("tcp://127.0.0.1:98x"), HasSubstr("port from 1 to 65535"));
  EXPECT_THAT(fault_of_endpoint("ipc://"), HasSubstr("names no file"));
}

// ZeroMQ would look for an interface of that name at every start, and find none.
TEST(PublishOptions, RefusesWhatCanBeNoAddressOfAnyMachine) {
  for (const char* host : {"lidar.example.org", "256.1.2.3", "1.2.3", "a b", "eth0/1", "[::1"}) {
    EXPECT_THAT(fault_of_endpoint(std::string("tcp://") + host + ":9872"),
                HasSubstr("where an address in numbers"))
        << host;
  }
  EXPECT_EQ(numeric_endpoint("tcp://localhost:9872"), "tcp://127.0.0.1:9872");
  EXPECT_EQ(numeric_endpoint("tcp://localhosts:9872"), "tcp://localhosts:9872");
  EXPECT_EQ(numeric_endpoint("ipc://localhost:9872"), "ipc://localhost:9872");
}

TEST(PublishOptions, TheTwoEndpointsAreTwo) {
  const auto fault =
      PublishOptions{.endpoint = "tcp://127.0.0.1:9872", .local_endpoint = "tcp://127.0.0.1:9872"}
          .validate();
  ASSERT_TRUE(fault);
  EXPECT_THAT(fault->what, HasSubstr("is /publish/endpoint too"));
  const char* any_port = "tcp://127.0.0.1:*";
  EXPECT_FALSE((PublishOptions{.endpoint = any_port, .local_endpoint = any_port}.validate()));
}

TEST(MetricsOptions, ServeThisMachineOnly) {
  const auto fault_of_http = [](const std::string& http) {
    const auto fault = MetricsOptions{.file = "", .http = http}.validate();
    return fault ? fault->pointer + ": " + fault->what : "";
  };
  for (const char* http : {"", "127.0.0.1:9873", "localhost:65535", "127.3.2.1:*"}) {
    EXPECT_EQ(fault_of_http(http), "") << http;
  }
  for (const char* http : {"0.0.0.0:9873", "*:9873", "192.168.1.2:9873", "127.example.org:9873"}) {
    EXPECT_THAT(fault_of_http(http), HasSubstr("without encryption")) << http;
  }
  for (const char* http : {"[::1]:9873", "lo:9873"}) {
    EXPECT_THAT(fault_of_http(http), HasSubstr("no IPv4 address")) << http;
  }
  EXPECT_THAT(fault_of_http("9873"), HasSubstr("/http: \"9873\" has no port"));
  EXPECT_THAT(fault_of_http("127.0.0.1:0"), HasSubstr("port from 1 to 65535"));
  EXPECT_THAT(fault_of_http("127.0.0.1:80,0.0.0.0:9873"), HasSubstr("would offer"));
  EXPECT_THAT(fault_of_http("http://127.0.0.1:9873"), HasSubstr("is a URL; write the address"));
}

TEST(PublishOptions, AnIpcPathHasToFitASocketAddress) {
  EXPECT_EQ(fault_of_endpoint("ipc://" + std::string(107, 'a')), "");
  EXPECT_THAT(fault_of_endpoint("ipc://" + std::string(108, 'a')), HasSubstr("108 bytes"));
}

TEST(RecordOptions, TheFolderHoldsTwoFiles) {
  RecordOptions options;
  EXPECT_FALSE(options.validate());
  options.max_file_mib = 1023;
  options.max_folder_gib = 2;
  EXPECT_FALSE(options.validate());
  options.max_folder_gib = 1.999;
  ASSERT_TRUE(options.validate());
  EXPECT_EQ(options.validate()->pointer, "/max_folder_gib");
  EXPECT_THAT(options.validate()->what, HasSubstr("1.999 is below 2.0, room for two files"));
}

}  // namespace
}  // namespace splid
