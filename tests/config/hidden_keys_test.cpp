#include "config/hidden_keys.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "config/json_text.hpp"
#include "config/option_reader.hpp"
#include "config/security_options.hpp"
#include "protocol/error.hpp"
#include "tests/support/error_text.hpp"

namespace splid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// That of the manual page of zmq_curve.
const std::string key = "D:)Q[IlAW!ahhC2ac:9*A}h:p?([4%wOTJ%JR%cs";

TEST(HiddenKeys, AKeyIsHiddenWhereverItIs) {
  EXPECT_EQ(hide_keys(key), "(a key?)");
  EXPECT_EQ(hide_keys("file: \"" + key + "\" cannot"), "file: \"(a key?)\" cannot");
  EXPECT_EQ(hide_keys("in /etc/splid/" + key), "in (a key?)");
  EXPECT_EQ(hide_keys(key.substr(2, 37)), "(a key?)") << "as a path may have changed it";
  EXPECT_EQ(hide_keys("'" + key + "' and '" + key), "'(a key?)' and '(a key?)");
}

TEST(HiddenKeys, NamesStay) {
  for (const char* text :
       {"", "/run/credentials/splid.service/server.key_secret", "/etc/splid/allowed.keys: no",
        "/home/anna/measurements/2026-11-22/run-0001.ptu", "tcp://[2001:db8::7]:9872",
        "config.json: /frame/min_seen_fraction: 2 is above 1, the most allowed"}) {
    EXPECT_EQ(hide_keys(text), text);
  }
}

std::string fault_of(const std::string& text) {
  return test::error_text([&] {
    const auto json = parse_json_text(text, "c.json");
    SecurityOptions options;
    OptionReader reader(json, "/etc/splid/c.json", "/security");
    options.describe(reader);
    reader.finish();
    if (const auto fault = options.validate()) throw Error(Fault::usage, fault->what);
  });
}

TEST(HiddenKeys, NoFaultOfTheConfigurationShowsOne) {
  for (const std::string& text :
       {R"({"server_key":")" + key + R"(","allow_list":"l"})",
        R"({"server_key":["k",")" + key + R"("]})", R"({"server_key":")" + key + "\n}",
        R"({"server_key":)" + key + "}", R"({")" + key + R"(":1})",
        R"({"unprotected":")" + key + R"("})", R"({"server_key":")" + key + R"("x})"}) {
    EXPECT_THAT(fault_of(text), AllOf(Not(testing::IsEmpty()), Not(HasSubstr("hhC2ac")))) << text;
  }
}

}  // namespace
}  // namespace splid
