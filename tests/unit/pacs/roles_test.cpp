// Who may do what on a shared server.
#include "osteo/hospital/pacs/roles.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <cstdlib>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

class RolesTest : public ::testing::Test {
 protected:
  ~RolesTest() override { ::unsetenv("OSTEO_ROLES"); }
  void write(const std::string& members) const { write_file(file_, "{\"osteotome_roles\": 1" + members + "}"); }
  [[nodiscard]] bool may_do(const std::string& members, std::string_view what) const {
    write(members);
    return may(read_roles(file_), what);
  }
  TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "roles.json";
  const std::string me_ = ::getpwuid(::getuid())->pw_name;
};

TEST_F(RolesTest, UsersAndGroups) {
  EXPECT_TRUE(may_do("", "approve")) << "nobody is named: as on a machine of one's own";
  EXPECT_TRUE(may_do(R"(, "send": ["no-such-user"])", "approve")) << "of the other";
  EXPECT_FALSE(may_do(R"(, "approve": ["no-such-user"])", "approve"));
  EXPECT_FALSE(may_do(R"(, "approve": ["@no-such-group"])", "approve"));
  EXPECT_TRUE(may_do(R"(, "approve": ["no-such-user", ")" + me_ + "\"]", "approve"));
  const group* const own = ::getgrgid(::getgid());
  if (own == nullptr) GTEST_SKIP() << "our group has no name";
  const std::string group = own->gr_name;
  EXPECT_TRUE(may_do(R"(, "send": ["@)" + group + "\"]", "send"));
  if (::getpwnam(group.c_str()) == nullptr)
    EXPECT_FALSE(may_do(R"(, "send": [")" + group + "\"]", "send")) << "a group is no user";
}

TEST_F(RolesTest, WhatIsWrongIsRefused) {
  for (const char* const members : {R"(, "aprove": ["a"])", R"(, "approve": [])", R"(, "approve": [""])",
                                    R"(, "approve": ["@"])", R"(, "approve": "a")", R"(, "send": [1])"}) {
    write(members);
    EXPECT_THROW(static_cast<void>(read_roles(file_)), Error) << members;
  }
}

TEST_F(RolesTest, ARefusalIsAudited) {
  AuditSettings settings;
  settings.to = "file:" + (folder_.path() / "audit.log").string();
  settings.queue = folder_.path() / "queue";
  const AuditTrail trail(settings);
  write(R"(, "approve": ["no-such-user"])");
  require_role("approve", trail, Context());  // no file is named
  ::setenv("OSTEO_ROLES", file_.c_str(), 1);
  require_role("send", trail, Context());
  EXPECT_FALSE(fs::exists(folder_.path() / "audit.log"));
  EXPECT_THROW(require_role("approve", trail, Context()), Error);
  const std::string text = read_text(folder_.path() / "audit.log");
  EXPECT_NE(text.find("csd-code=\"110132\""), std::string::npos) << text;
  EXPECT_NE(text.find("EventOutcomeIndicator=\"4\""), std::string::npos);
  EXPECT_NE(text.find("ParticipantObjectID=\"approve\""), std::string::npos);
  EXPECT_EQ(check_roles().state, ServerFinding::State::bad) << "a user whom nobody knows";
  write(R"(, "approve": [")" + me_ + "\"]");
  require_role("approve", trail, Context());
  EXPECT_EQ(check_roles().state, ServerFinding::State::good);
  ::setenv("OSTEO_ROLES", (folder_.path() / "gone.json").c_str(), 1);
  EXPECT_THROW(require_role("approve", trail, Context()), Error) << "a file that is gone is no leave";
}

}  // namespace
}  // namespace osteo
