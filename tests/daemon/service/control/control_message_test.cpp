#include "daemon/service/control/control_message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "protocol/json_value.hpp"
#include "tests/support/manual_members.hpp"

namespace splid::control {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
  try {
    (void)request_from_json(text);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::usage);
    return error.what();
  }
  return "";
}

std::string request(const std::string& members) {
  return R"({"schema":"splid.control","v":[1,0],)" + members + "}";
}

TEST(ControlRequest, IsPinned) {
  for (const Command command : {Command::status, Command::start, Command::stop,
                                Command::record_start, Command::record_stop, Command::upload}) {
    const std::string text = request(R"("request":")" + std::string(to_string(command)) + '"');
    EXPECT_EQ(request_from_json(text).command, command);
    EXPECT_EQ(to_json(request_from_json(text)), text);
  }
  EXPECT_STREQ(to_string(Command::record_stop), "record_stop");
  const std::string calibrate = request(
      R"("request":"calibrate","seconds":600,"distance_m":2.5,"time_ps":1,"amplitude_percent":100)");
  const CalibrateRequest most = request_from_json(calibrate).calibrate;
  EXPECT_EQ(most.seconds, 600);
  EXPECT_EQ(most.distance_m, 2.5);
  EXPECT_EQ(to_json(request_from_json(calibrate)), calibrate);
  const CalibrateRequest least =
      request_from_json(request(R"("request":"calibrate","seconds":0.1)")).calibrate;
  EXPECT_EQ(least.seconds, 0.1);
  EXPECT_EQ(least.distance_m, std::nullopt);
  EXPECT_EQ(least.time_ps, 5);
  EXPECT_EQ(least.amplitude_percent, 2);
}

TEST(ControlRequest, RefusesWhatIsNoneInASentence) {
  EXPECT_THAT(refusal(""), HasSubstr("request: line 1, column 1: is not JSON"));
  EXPECT_THAT(refusal(std::string("\0\xff{", 3)), HasSubstr("is not JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("is no object"));
  EXPECT_THAT(refusal("{}"), HasSubstr("schema"));
  EXPECT_THAT(refusal(R"({"schema":"splid.config","request":"stop"})"),
              HasSubstr("/schema: \"splid.config\" is not \"splid.control\""));
  EXPECT_THAT(refusal(R"({"schema":"splid.control","v":[2,0],"request":"stop"})"),
              HasSubstr("/v: [2,0] is not [1, x]"));
  EXPECT_THAT(refusal(request(R"("request":1)")), HasSubstr("/request: 1 is none of status"));
  EXPECT_THAT(refusal(request(R"("request":"strat")")), HasSubstr("did you mean start?"));
  EXPECT_THAT(refusal(R"({"schema":"splid.control"})"), HasSubstr("/request"));
  EXPECT_THAT(refusal(request(R"("request":"stop","request":"start")")), HasSubstr("given twice"));
  EXPECT_THAT(refusal(request(R"("request":"stop","seconds":1)")), HasSubstr("/seconds"));
  EXPECT_THAT(refusal(request(R"("request":"calibrate")")), HasSubstr("/seconds"));
  EXPECT_THAT(refusal(request(R"("request":"calibrate","seconds":0)")), HasSubstr("/seconds: 0"));
  EXPECT_THAT(refusal(request(R"("request":"calibrate","seconds":601)")), HasSubstr("601"));
  EXPECT_THAT(refusal(request(R"("request":"calibrate","seconds":"1")")), HasSubstr("/seconds"));
  EXPECT_THAT(refusal(request(R"("request":"calibrate","seconds":1e999)")), HasSubstr("request: "));
  EXPECT_THAT(refusal(request(R"("request":"calibrate","second":1,"seconds":2)")),
              HasSubstr("did you mean seconds?"));
  EXPECT_THAT(refusal(std::string(2000, '[') + std::string(2000, ']')), HasSubstr("deeply"));
  EXPECT_THAT(refusal(std::string(4097, ' ')), HasSubstr("4097 bytes are more than the 4096"));
}

TEST(ControlReply, IsPinned) {
  const Reply done{"record_start", {}, "recording", {{"file", R"("a.ptu")"}, {"n", "[1]"}}};
  const std::string text =
      R"({"schema":"splid.control","v":[1,0],"request":"record_start","ok":true,)"
      R"("message":"recording","file":"a.ptu","n":[1]})";
  EXPECT_EQ(to_json(done), text);
  EXPECT_EQ(to_json(reply_from_json(text)), text);
  EXPECT_EQ(reply_from_json(text).find("n"), "[1]");
  EXPECT_EQ(reply_from_json(text).find("none"), "");

  const std::pair<Fault, std::string> faults[] = {
      {Fault::usage, "usage"}, {Fault::device, "device"}, {Fault::data, "data"}};
  for (const auto& [fault, name] : faults) {
    const std::string refused = R"({"schema":"splid.control","v":[1,0],"ok":false,"error":"no",)"
                                R"("fault":")" +
                                name + "\"}";
    EXPECT_EQ(to_json(Reply{"", fault, "no"}), refused);
    EXPECT_EQ(reply_from_json(refused).fault, fault);
    EXPECT_EQ(to_json(reply_from_json(refused)), refused);
  }
}

TEST(ControlReply, IsOfASplid) {
  for (const char* text : {"", "[]", "{}", R"({"ok":true})", R"({"schema":"splid.control"})",
                           R"({"schema":1,"ok":true})"}) {
    EXPECT_THROW((void)reply_from_json(text), Error) << text;
  }
}

// libFuzzer hardly ever makes up a request or a member, so that each has to stand in a seed.
TEST(ControlMessage, EveryRequestAndMemberIsInAFuzzSeed) {
  const auto text_of = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  std::string seeds;
  for (const auto& entry :
       std::filesystem::directory_iterator(SPLID_SOURCE_DIR "/tests/fuzz/corpus/control")) {
    seeds += text_of(entry.path());
  }
  const std::string page = "\n" + text_of(SPLID_SOURCE_DIR "/docs/reference/control.md");
  std::vector<std::string> members = test::manual_members(page, "# Control: requests and replies");
  EXPECT_GE(members.size(), 9U);
  const Request all{Command::calibrate, {1, 2, 3, 4}};
  const nlohmann::json request = json_value(to_json(all));
  for (const auto& member : request.items()) members.push_back(member.key());
  for (const std::string& member : members) {
    EXPECT_THAT(seeds, HasSubstr('"' + member + "\":"));
  }
  for (auto command = Command::status; command <= Command::calibrate;
       command = static_cast<Command>(static_cast<int>(command) + 1)) {
    EXPECT_THAT(seeds, HasSubstr("\"request\":\"" + std::string(to_string(command)) + '"'));
  }
}

}  // namespace
}  // namespace splid::control
