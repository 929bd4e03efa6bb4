// What a web server answers, in pieces; and addresses.
#include <gtest/gtest.h>

#include <random>

#include "http.h"
#include "multipart.h"
#include "osteo/core/base/error.h"
#include "osteo/hospital/pacs/dicomweb.h"

namespace osteo {
namespace {

using pacs::MultipartReader;
using pacs::parse_media_type;

// Heads and contents of the parts of `text`, given in pieces of `size` bytes; "!" where it does not come to its end.
std::string parts_of(const std::string& text, std::size_t size, const std::string& boundary = "b0") {
  std::string said;
  MultipartReader reader(boundary, {[&](const auto& head) {
                                      said += "[";
                                      for (const auto& [name, value] : head) said += name + "=" + value + ";";
                                      said += "|";
                                    },
                                    [&](std::string_view piece) { said += piece; }, [&] { said += "]"; }});
  for (std::size_t at = 0; at < text.size(); at += size) reader.feed(std::string_view(text).substr(at, size));
  return said + (reader.whole() ? "" : "!");
}

TEST(Multipart, PartsAreTheSameInPiecesOfAnySize) {
  const std::string text =
      "words before\r\n--b0\r\nContent-Type: application/dicom\r\nX:  y \r\n\r\nfirst\r\n-\r\n--b\r\n--b0 "
      "\t\r\n\r\n\r\n--b0\r\nA: "
      "1\r\n\r\n\r\n\r\n--b0--words after\r\n--b0\r\n";
  for (std::size_t size = 1; size <= text.size(); ++size)
    ASSERT_EQ(parts_of(text, size), "[content-type=application/dicom;x=y;|first\r\n-\r\n--b][|][a=1;|\r\n]") << size;
  EXPECT_EQ(parts_of("--b0\r\n\r\nx\r\n--b0--", 3), "[|x]") << "a boundary at the very beginning";
  EXPECT_EQ(parts_of("--b0--", 1), "") << "no part at all";
}

TEST(Multipart, WhatIsCutIsNotWhole) {
  const std::string text = "--b0\r\nA: 1\r\n\r\nx\r\n--b0\r\n\r\ny\r\n--b0--";
  for (std::size_t cut = 0; cut < text.size(); ++cut) EXPECT_EQ(parts_of(text.substr(0, cut), 5).back(), '!') << cut;
}

TEST(Multipart, WhatIsNoneIsRefused) {
  const std::vector<std::string> all{"--b0x\r\n\r\ny\r\n--b0--",      "\r\n--b0\r\nno head\r\n\r\ny",
                                     "--b0\r\nA: 1\r\nA: 2\r\n\r\ny", "--b0\r\nA: " + std::string(20'000, 'a'),
                                     std::string(40'000, 'p'),        "--b0" + std::string(20'000, ' ')};
  for (const std::string& text : all)
    for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{1} << 20U})
      EXPECT_THROW(static_cast<void>(parts_of(text, size)), Error) << text.substr(0, 40) << " in pieces of " << size;
  for (const std::string& boundary :
       {std::string(), std::string(71, 'a'), std::string("a\r\nb"), std::string("a "), std::string("a\"b")})
    EXPECT_THROW(MultipartReader(boundary, {}), Error) << boundary;
  // RFC 2046 allows these, and no others.
  std::string allowed;
  for (int c = 1; c < 128; ++c) {
    const std::string boundary{static_cast<char>(c), 'b'};
    try {
      MultipartReader(boundary, {});
      allowed += static_cast<char>(c);
    } catch (const Error&) {
      continue;
    }
  }
  EXPECT_EQ(allowed, " '()+,-./0123456789:=?ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz");
  EXPECT_NO_THROW(MultipartReader(std::string(70, 'a'), {}));
}

// Whatever comes: the same parts, or the same refusal, in pieces of any size, and nothing is read that is not there
// (sanitizers).
TEST(Multipart, MutationsAreTakenTheSameWayInPieces) {
  const std::string begin = "\r\n--b0\r\nA: 1\r\n\r\nfirst\r\n--b0\r\n\r\n--b\r\n--b0--", bits = "\r\n-b0 :;=\"\\A";
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return random() % n; };
  const auto outcome = [](const std::string& text, std::size_t size) {
    try {
      return parts_of(text, size);
    } catch (const Error& e) {
      return std::string(e.what());
    }
  };
  std::size_t refused = 0;
  for (int n = 0; n < 20'000; ++n) {
    std::string text = begin;
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
      const std::size_t at = below(text.size());
      const char c = bits[below(bits.size())];
      switch (below(3)) {
        case 0:
          text[at] = c;
          break;
        case 1:
          text.insert(text.begin() + static_cast<std::ptrdiff_t>(at), c);
          break;
        default:
          text.erase(at, 1 + below(3));
          break;
      }
    }
    const std::string whole = outcome(text, text.size());
    refused += whole.starts_with("an answer") ? 1 : 0;
    ASSERT_EQ(outcome(text, 1), whole) << text;
    ASSERT_EQ(outcome(text, 1 + below(9)), whole) << text;
    try {
      static_cast<void>(parse_media_type(text));
    } catch (const Error&) {
    }
  }
  EXPECT_GT(refused, 1'000U);
}

TEST(MediaType, IsReadWithItsParameters) {
  const auto t = parse_media_type("Multipart/Related ; TYPE=\"application/dicom\";boundary = \"a \\\"b; c\" ;x=y;");
  EXPECT_EQ(t.name, "multipart/related");
  EXPECT_EQ(t.parameters.at("type"), "application/dicom");
  EXPECT_EQ(t.parameters.at("boundary"), "a \"b; c");
  EXPECT_EQ(t.parameters.at("x"), "y");
  EXPECT_EQ(parse_media_type("").name, "");
  EXPECT_EQ(parse_media_type("a/b;;").name, "a/b");
  for (const char* const bad : {"a/b; x", "a/b; x=\"y", "a/b; x=1; X=2", "a/b; x=\"y\\"})
    EXPECT_THROW(static_cast<void>(parse_media_type(bad)), Error) << bad;
}

TEST(WebServer, AddressesAreReadStrictly) {
  const auto check = [](const char* url, const char* login = "") {
    WebServer s;
    s.url = url;
    s.login = login;
    check_dicomweb(s);
  };
  for (const char* const good : {"https://pacs.example/dicom-web", "http://127.0.0.1:8042/x/", "http://localhost",
                                 "http://[::1]:80/x", "https://[::2]"})
    EXPECT_NO_THROW(check(good, "a:b")) << good;
  for (const char* const bad :
       {"", "ftp://x", "https://", "https:///", "HTTPS://x", "https://a:b@x", "https://x?y", "https://x#y",
        "https://x y", "https://x\\y", "https://x\r\ny", "http://pacs.example", "http://127.0.0.1.example",
        "http://[::1].example", "http://localhost.example", "http://127.0.0.10", "http://[::1"})
    EXPECT_THROW(check(bad), Error) << bad;
}

}  // namespace
}  // namespace osteo
