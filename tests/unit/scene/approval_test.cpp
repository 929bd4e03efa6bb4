// An approval holds for what was looked at, and for nothing else.
#include "osteo/session/scene/approval.h"

#include <gtest/gtest.h>

#include <fstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/report/sheet.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {
namespace {

void put(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

std::string html(const std::string& said, const std::string& by) {
  Sheet s;
  s.title = said;
  s.blocks.push_back({sheet::Signature{by, "", "", by.empty() ? "not approved" : "approved"}});
  return sheet_html(s);
}

struct Approved : testing::Test {
  TemporaryFolder at;
  fs::path folder = at.path() / "case";
  void SetUp() override {
    fs::create_directory(folder);
    put(folder / "bone.vdb", "bone");
    put(folder / "structures.seg.nrrd", "nerve");
    put(folder / "manifest.json",
        R"({"osteotome_case": 1, "files": {"bone": {"file": "bone.vdb", "hash": "x"}, "structures": {"file": "structures.seg.nrrd", "hash": "y"}}})");
    put(report_file(folder, ".html"), html("report", ""));
  }
};

TEST_F(Approved, HoldsUntilAByteChanges) {
  EXPECT_EQ(approval_of(folder).words(), "not approved");
  EXPECT_THROW(require_approval(approval_of(folder), folder), Error);
  approve(folder, "A. Miller", "mastoid only");
  ApprovalNow now = approval_of(folder);
  EXPECT_EQ(now.state, ApprovalState::valid);
  EXPECT_EQ(now.approval->by, "A. Miller");
  EXPECT_EQ(now.approval->date.size(), 10U);
  EXPECT_NO_THROW(require_approval(now, folder));
  // The report as it is when it shows the signature.
  put(report_file(folder, ".html"), html("report", "A. Miller"));
  EXPECT_EQ(approval_of(folder).state, ApprovalState::valid);

  put(folder / "bone.vdb", "bonf");
  now = approval_of(folder);
  EXPECT_EQ(now.state, ApprovalState::outdated);
  EXPECT_EQ(now.changed, "bone");
  EXPECT_NE(now.words().find("no longer valid"), std::string::npos);
  EXPECT_THROW(require_approval(now, folder), Error);
  put(folder / "bone.vdb", "bone");
  EXPECT_EQ(approval_of(folder).state, ApprovalState::valid);

  fs::remove(folder / "structures.seg.nrrd");
  EXPECT_EQ(approval_of(folder).changed, "structures");
  put(folder / "structures.seg.nrrd", "nerve");
  put(report_file(folder, ".html"), html("another report", "A. Miller"));
  EXPECT_EQ(approval_of(folder).changed, "the report");
  fs::remove(report_file(folder, ".html"));  // the case was copied without it
  EXPECT_EQ(approval_of(folder).state, ApprovalState::valid);

  EXPECT_TRUE(withdraw_approval(folder));
  EXPECT_FALSE(withdraw_approval(folder));
  EXPECT_EQ(approval_of(folder).state, ApprovalState::none);
}

TEST_F(Approved, AFileMoreOrLessInTheManifestEndsIt) {
  approve(folder, "A", "");
  put(folder / "manifest.json", R"({"osteotome_case": 1, "files": {"bone": {"file": "bone.vdb", "hash": "x"}}})");
  EXPECT_EQ(approval_of(folder).state, ApprovalState::outdated);
  EXPECT_EQ(approval_of(folder).changed, "a file that is gone");
}

TEST_F(Approved, DamagedIsNotValid) {
  approve(folder, "A", "");
  const std::string text = read_text(folder / "approval.json");
  for (std::size_t n = 0; n + 3 < text.size(); n += 7) {
    put(folder / "approval.json", text.substr(0, n));
    EXPECT_EQ(approval_of(folder).state, ApprovalState::outdated) << n;
  }
}

TEST_F(Approved, WhatCannotBeSigned) {
  EXPECT_THROW(approve(folder, "", ""), Error);
  EXPECT_THROW(approve(folder, "A\nB", ""), Error);
  EXPECT_THROW(approve(folder, std::string(81, 'a'), ""), Error);
  EXPECT_THROW(approve(folder, "A", std::string(301, 'a')), Error);
  EXPECT_THROW(static_cast<void>(approval_of(at.path())), Error);
  fs::remove(report_file(folder, ".html"));
  try {
    approve(folder, "A", "");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::no_input);
  }
  EXPECT_FALSE(fs::exists(folder / "approval.json"));
}

TEST_F(Approved, EverySessionSaysIt) {
  const SessionFolder before = create_session_folder({}, folder, {});
  EXPECT_EQ(open_session_folder(before.folder).approval, "not approved");
  approve(folder, "A. Miller", "");
  const SessionFolder session = create_session_folder({}, folder, {});
  put(folder / "bone.vdb", "changed");
  EXPECT_EQ(open_session_folder(session.folder).approval.find("approved by A. Miller on "), 0U);  // as it was then
  EXPECT_NE(open_session_folder(create_session_folder({}, folder, {}).folder).approval.find("no longer valid"),
            std::string::npos);
  // Of an earlier version.
  put(session.folder / "session.json", R"({"osteotome_session_folder": 1, "case": "../.."})");
  EXPECT_EQ(open_session_folder(session.folder).approval, "");
}

TEST(ReportFile, LiesBesideTheCase) {
  EXPECT_EQ(report_file("/a/b/case", ".html"), "/a/b/case.report.html");
  EXPECT_EQ(report_file("/a/b/case/", ".pdf"), "/a/b/case.report.pdf");
  EXPECT_EQ(report_file("/a/b/../case/.", ".pdf"), "/a/case.report.pdf");
}

}  // namespace
}  // namespace osteo
