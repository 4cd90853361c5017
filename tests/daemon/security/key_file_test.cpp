#include "daemon/security/key_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "daemon/security/guarded_file.hpp"
#include "tests/support/error_text.hpp"
#include "tests/support/program.hpp"

namespace splid::security {
namespace {

using splid::test::file_text;
using splid::test::TempFolder;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

// RFC 26's test keys of CURVE in Z85, and those of the manual page of zmq_curve.
constexpr const char* public_key = "Yne@$w-vo<fVvi]a<NY6T1ed:M$fCG*[IaLV{hID";
constexpr const char* secret_key = "D:)Q[IlAW!ahhC2ac:9*A}h:p?([4%wOTJ%JR%cs";

std::string secret_text() {
  return std::string("# made by another\nmetadata\n    name = \"x\"\ncurve\n    public-key = \"") +
         public_key + "\"\n    secret-key = \"" + secret_key + "\"\n";
}

mode_t mode_of(const std::string& file) {
  struct stat facts {};
  return ::stat(file.c_str(), &facts) == 0 ? facts.st_mode & 07777U : 0;
}

TEST(CurveKeys, AreFortyCharactersOfZ85) {
  EXPECT_TRUE(is_curve_key(public_key));
  EXPECT_TRUE(is_curve_key(std::string(40, '0')));
  EXPECT_FALSE(is_curve_key("#" + std::string(39, '0'))) << "passes 32 bits; see AllowList";
  EXPECT_FALSE(is_curve_key(""));
  EXPECT_FALSE(is_curve_key(std::string(39, '0')));
  EXPECT_FALSE(is_curve_key(std::string(41, '0')));
  EXPECT_FALSE(is_curve_key(std::string(39, '0') + "\""));
  EXPECT_FALSE(is_curve_key(std::string(39, '0') + " "));
}

TEST(CurveKeys, AreWrittenAsTheirBytes) {
  std::array<std::byte, curve_key_bytes> key{};
  EXPECT_EQ(curve_key_text(key), std::string(40, '0'));
  key.back() = std::byte{1};
  EXPECT_EQ(curve_key_text(key), std::string(39, '0') + "1");
  key.fill(std::byte{0xff});
  EXPECT_EQ(curve_key_text(key), "%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0");
  EXPECT_TRUE(is_curve_key("%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0"));
  EXPECT_FALSE(is_curve_key("%nSc1%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0%nSc0"));
}

TEST(CurveKeys, ThePublicOneFollowsFromTheSecretOne) {
  EXPECT_EQ(public_key_of(secret_key), public_key);
  const CurveKeyPair keys = make_curve_keys();
  EXPECT_EQ(public_key_of(keys.secret_key), keys.public_key);
  EXPECT_NE(keys.secret_key, make_curve_keys().secret_key);
}

TEST(KeyFiles, AreReadAsTheyWereWritten) {
  const TempFolder folder;
  const CurveKeyPair keys = make_curve_keys();
  const mode_t before = umask(0);
  const KeyFiles files = write_key_files(folder.path(""), "viewer-2.b_c", keys);
  umask(before);
  EXPECT_EQ(files.public_file, folder.path("viewer-2.b_c.key"));
  EXPECT_EQ(mode_of(files.secret_file), 0600u);
  EXPECT_EQ(mode_of(files.public_file), 0644u);
  const CurveKeyPair read = read_secret_key(files.secret_file);
  EXPECT_EQ(read.secret_key, keys.secret_key);
  EXPECT_EQ(read.public_key, keys.public_key);
  EXPECT_EQ(read_public_key(files.public_file), keys.public_key);
  EXPECT_EQ(read_public_key(files.secret_file), keys.public_key);
  EXPECT_EQ(read_public_key(keys.public_key), keys.public_key);
}

TEST(KeyFiles, AreNeverWrittenOver) {
  const TempFolder folder;
  for (const char* there : {"a.key", "b.key_secret"}) {
    const std::string file = folder.write(there, "precious");
    EXPECT_THAT(test::error_text([&] {
                  write_key_files(folder.path(""), std::string(1, *there), make_curve_keys());
                }),
                AllOf(StartsWith(file), HasSubstr("never written over")));
    EXPECT_EQ(file_text(file), "precious");
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.key_secret"))) << "half a pair stayed";
  EXPECT_FALSE(std::filesystem::exists(folder.path("b.key")));
}

TEST(KeyFiles, HaveANameAndAFolder) {
  const TempFolder folder;
  for (const char* name : {"", "../x", "a/b", ".hidden", "-o", "a b", "a\nb"}) {
    EXPECT_THAT(
        test::error_text([&] { write_key_files(folder.path(""), name, make_curve_keys()); }),
        HasSubstr("cannot name a key"))
        << name;
  }
  EXPECT_THAT(
      test::error_text([&] { write_key_files(folder.path("none"), "a", make_curve_keys()); }),
      AllOf(StartsWith(folder.path("none/a.key_secret")), HasSubstr("No such file")));
}

// As on a disk that is nearly full, which takes a part of them.
TEST(KeyFiles, AreWholeOrNotThere) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit little{100, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  errno = 0;
  const std::string said =
      test::error_text([&] { write_key_files(folder.path(""), "a", make_curve_keys()); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(said, AllOf(StartsWith(folder.path("a.key_secret")), HasSubstr("File too large")));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path("")));
}

TEST(KeyFiles, OfOtherToolsAreRead) {
  EXPECT_EQ(parse_secret_key(secret_text(), "f").public_key, public_key);
  EXPECT_EQ(parse_public_key(std::string("public-key=") + public_key, "f"), public_key);
  EXPECT_EQ(parse_public_key(std::string("\tpublic-key  =\t'") + public_key + "'\r\n", "f"),
            public_key);
}

TEST(KeyFiles, SayWhatIsWrongWithThem) {
  const auto fault_of = [](const std::string& text) {
    return test::error_text([&] { parse_secret_key(text, "f"); });
  };
  EXPECT_THAT(fault_of(""), StartsWith("f: has no line secret-key = "));
  EXPECT_THAT(fault_of("secret-key = \"short\""), HasSubstr("f: its secret-key is no key"));
  EXPECT_THAT(fault_of(std::string("public-key = \"") + secret_key + "\"\nsecret-key = \"" +
                       secret_key + "\""),
              HasSubstr("is not that of its secret-key"));
  EXPECT_THAT(test::error_text([] { parse_public_key("secret-key = \"x\"", "f"); }),
              StartsWith("f: has no line public-key"));
}

class SecretFile : public testing::Test {
 protected:
  std::string write(mode_t mode, const std::string& name = "own/s") const {
    const std::string file = folder.write(name, secret_text());
    ::chmod(file.c_str(), mode);
    return file;
  }
  static std::string fault_of(const std::string& file) {
    return test::error_text([&] { read_secret_key(file); });
  }
  static std::string fault_of_list(const std::string& file) {
    return test::error_text([&] { read_unforgeable_file(file); });
  }
  const TempFolder folder;
};

TEST_F(SecretFile, IsForItsOwnerAlone) {
  for (const mode_t mode : {0600, 0400, 0700}) EXPECT_EQ(fault_of(write(mode)), "") << mode;
  for (const mode_t mode : {0644, 0640, 0604, 0620, 0601}) {
    const std::string file = write(mode);
    EXPECT_THAT(fault_of(file), AllOf(StartsWith(file + ": is a secret that others"),
                                      HasSubstr("chmod 600 " + file)))
        << mode;
  }
  EXPECT_THAT(fault_of(write(0644)), HasSubstr("mode 0644"));
}

TEST_F(SecretFile, IsWhereNobodyElseCanPutAnother) {
  const std::string file = write(0600);
  const std::string own = folder.path("own");
  for (const mode_t mode : {0777, 0775, 0757}) {
    ::chmod(own.c_str(), mode);
    EXPECT_THAT(fault_of(file), AllOf(StartsWith(own), HasSubstr("chmod go-w " + own))) << mode;
    EXPECT_THAT(fault_of_list(file), HasSubstr("chmod go-w " + own)) << mode;
  }
  for (const mode_t mode : {01777, 0755, 0700}) {
    ::chmod(own.c_str(), mode);
    EXPECT_EQ(fault_of(file), "") << mode;
  }
}

TEST_F(SecretFile, IsOursOrRoots) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  const std::string file = write(0600);
  ASSERT_EQ(::chown(file.c_str(), 12345, 0), 0);
  EXPECT_THAT(fault_of(file), AllOf(StartsWith(file), HasSubstr("belongs to user 12345")));
  EXPECT_THAT(fault_of_list(file), HasSubstr("belongs to user 12345"));
  ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  ASSERT_EQ(::chown(folder.path("own").c_str(), 12345, 0), 0);
  EXPECT_THAT(fault_of(file), StartsWith(folder.path("own") + ": belongs to user 12345"));
}

// As ssh does: who may write a folder above may put another one in the place of all below it.
TEST_F(SecretFile, IsBelowFoldersThatNobodyElseCanWrite) {
  const std::string file = write(0600, "above/own/s");
  const std::string above = folder.path("above");
  EXPECT_EQ(fault_of(file), "");
  for (const mode_t mode : {0777, 0775, 0757}) {
    ::chmod(above.c_str(), mode);
    EXPECT_THAT(fault_of(file),
                AllOf(StartsWith(above + ": lets others"), HasSubstr("chmod go-w " + above)))
        << mode;
    EXPECT_THAT(fault_of_list(file), StartsWith(above + ": lets others")) << mode;
  }
  ::chmod(above.c_str(), 01777);
  EXPECT_EQ(fault_of(file), "");
  if (::geteuid() != 0) return;
  ASSERT_EQ(::chown(above.c_str(), 12345, 0), 0);
  ::chmod(above.c_str(), 0755);
  EXPECT_THAT(fault_of(file), StartsWith(above + ": belongs to user 12345"));
}

TEST_F(SecretFile, IsNotReachedThroughALinkThatOthersCanTurn) {
  const std::string file = write(0600);
  const std::string open = folder.path("open");
  ASSERT_EQ(::mkdir(open.c_str(), 0700), 0);
  const std::string link = open + "/s";
  const std::string chain = folder.path("chain");
  std::filesystem::create_symlink(file, link);
  std::filesystem::create_symlink("open/../open/s", chain);
  for (const std::string& name : {link, chain}) {
    ::chmod(open.c_str(), 0700);
    EXPECT_EQ(fault_of(name), "");
    ::chmod(open.c_str(), 0777);
    EXPECT_THAT(fault_of(name), StartsWith(open + ": lets others")) << name;
    EXPECT_THAT(fault_of_list(name), StartsWith(open + ": lets others")) << name;
  }
  ::chmod(open.c_str(), 0700);
  ::chmod(folder.path("own").c_str(), 0777);
  EXPECT_THAT(fault_of(link), StartsWith(folder.path("own") + ": lets others"));
  if (::geteuid() != 0) return;
  ::chmod(folder.path("own").c_str(), 0700);
  ASSERT_EQ(::lchown(link.c_str(), 12345, 0), 0);
  EXPECT_THAT(fault_of(link), StartsWith(link + ": belongs to user 12345"));
}

TEST_F(SecretFile, ARoundOfLinksEnds) {
  std::filesystem::create_symlink(folder.path("b"), folder.path("a"));
  std::filesystem::create_symlink(folder.path("a"), folder.path("b"));
  EXPECT_THAT(fault_of(folder.path("a")), HasSubstr("symbolic links"));
}

TEST_F(SecretFile, AKeyInThePlaceOfAFileIsNotShown) {
  for (const std::string& name :
       {std::string(secret_key), folder.path(secret_key), std::string(secret_key).substr(1)}) {
    EXPECT_THAT(fault_of(name), AllOf(HasSubstr("cannot be read"), HasSubstr("(a key?)"),
                                      testing::Not(HasSubstr("hhC2ac"))));
  }
  EXPECT_THAT(test::error_text([] { read_public_key(std::string(secret_key).substr(1)); }),
              AllOf(HasSubstr("looks like a key"), testing::Not(HasSubstr("hhC2ac"))));
}

TEST_F(SecretFile, OfTheServiceManagerIsTakenAsItIs) {
  const std::string file = write(0440);
  ASSERT_NE(fault_of(file), "");
  ::setenv("CREDENTIALS_DIRECTORY", folder.path("own").c_str(), 1);
  EXPECT_EQ(fault_of(file), "");
  EXPECT_NE(fault_of(write(0440, "other/s")), "");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST_F(SecretFile, IsAFile) {
  EXPECT_THAT(fault_of(folder.path("none")), HasSubstr("No such file"));
  ::mkdir(folder.path("own").c_str(), 0700);
  EXPECT_THAT(fault_of(folder.path("own")), HasSubstr("is no file"));
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  EXPECT_THAT(fault_of(folder.path("pipe")), HasSubstr("is no file"));
}

TEST_F(SecretFile, AListMayBeReadByAllAndWrittenByItsOwner) {
  EXPECT_EQ(fault_of_list(write(0644)), "");
  for (const mode_t mode : {0664, 0646}) {
    EXPECT_THAT(fault_of_list(write(mode)), HasSubstr("chmod go-w")) << mode;
  }
}

}  // namespace
}  // namespace splid::security
