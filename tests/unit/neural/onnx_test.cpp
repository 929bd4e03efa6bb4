// Networks in ONNX files against nnunetv2's own answer, and files that nobody should trust.
#include "osteo/imaging/neural/detail/onnx.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <random>

#include "golden.h"
#include "network_steps.h"
#include "osteo/core/base/error.h"
#include "scratch.h"

namespace osteo {
namespace {

TEST(NetworkOnnx, GivesWhatTheCheckpointGives) {
  for (const auto& [name, of] :
       {std::pair{"onnx/older", "onnx/older"}, {"onnx/newer", "onnx/older"}, {"onnx/flat", "flat"}}) {
    const Agreement a = agreement(name, of);
    EXPECT_GE(a.found, 2) << name;
    EXPECT_LE(a.worst, 1e-3) << name;
    EXPECT_LE(a.mean, 2e-6) << name;
    EXPECT_GE(a.labels, 0.9999) << name;
  }
}

std::string network_json() {
  return read_text(golden("onnx/older") / "network.json");
}

std::string refusal_of_json(const std::string& from, const std::string& to) {
  std::string text = network_json();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  try {
    static_cast<void>(read_onnx_model(text));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::corrupt);
    return error.what();
  }
  return "";
}

TEST(NetworkOnnx, ItsDescriptionIsReadStrictly) {
  const OnnxModel m = read_onnx_model(network_json());
  EXPECT_EQ(m.file, "network.onnx");
  EXPECT_EQ(m.mirror_axes, (std::vector<int>{0, 2}));
  EXPECT_EQ(m.network.patch, (Axes{8, 16, 16}));
  EXPECT_EQ(m.network.unet.classes, 3);
  EXPECT_EQ(m.network.deviation, 401.75);
  EXPECT_NE(refusal_of_json("\"onnx\": \"network.onnx\"", "\"onnx\": \"../network.onnx\"").find("beside"),
            std::string::npos);
  EXPECT_NE(refusal_of_json("mirror_axes", "mirror").find("'mirror' is not known"), std::string::npos);
  EXPECT_NE(refusal_of_json("\"std\": 401.75", "\"std\": 0").find("std"), std::string::npos);
  EXPECT_NE(refusal_of_json("\"lower\": -950.0", "\"lower\": 9000").find("upper"), std::string::npos);
  EXPECT_NE(refusal_of_json("\"spacing_mm\": [\n  1.0,", "\"spacing_mm\": [").find("spacing_mm"), std::string::npos);
  EXPECT_NE(refusal_of_json("\"nerve\": 1", "\"nerve\": 5").find("labels"), std::string::npos);
  EXPECT_NE(refusal_of_json("{", "").find("JSON"), std::string::npos);
}

std::vector<std::byte> graph_bytes(const std::string& name = "older") {
  return read_file(golden("onnx/" + name) / "network.onnx");
}

std::string refusal_of(const std::vector<std::byte>& bytes, const fs::path& beside, int classes = 3,
                       const Axes& patch = {8, 16, 16}) {
  try {
    static_cast<void>(read_onnx(bytes, beside, classes, patch));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::corrupt);
    return error.what();
  }
  return "";
}

std::vector<std::byte> with(std::vector<std::byte> bytes, std::string_view from, std::string_view to) {
  EXPECT_EQ(from.size(), to.size());
  int met = 0;
  for (std::size_t at = 0; at + from.size() <= bytes.size(); ++at) {
    if (std::memcmp(bytes.data() + at, from.data(), from.size()) != 0) continue;
    std::memcpy(bytes.data() + at, to.data(), to.size());
    ++met;
  }
  EXPECT_GT(met, 0) << from;
  return bytes;
}

TEST(NetworkOnnx, WhatIsNotSupportedIsNamed) {
  const fs::path beside = golden("onnx/older");
  EXPECT_EQ(refusal_of(graph_bytes(), beside), "");
  EXPECT_NE(refusal_of(with(graph_bytes(), "LeakyRelu", "HardSwish"), beside).find("HardSwish"), std::string::npos);
  EXPECT_NE(refusal_of(graph_bytes(), beside, 4).find("3 classes, and network.json names 4"), std::string::npos);
  EXPECT_NE(refusal_of(graph_bytes(), beside, 3, {8, 15, 16}).find("multiple of its strides"), std::string::npos);
  EXPECT_NE(refusal_of({}, beside).find("no graph"), std::string::npos);
  EXPECT_NE(refusal_of(std::vector<std::byte>(64, std::byte{0xff}), beside), "");
  auto half = graph_bytes();
  half.resize(half.size() / 2);
  EXPECT_NE(refusal_of(half, beside), "");
}

// Weights in a file beside: missing, too short, somewhere else.
TEST(NetworkOnnx, WeightsOutsideAreLookedForBesideItAlone) {
  const test::ScratchFolder dir;
  const auto bytes = graph_bytes("newer");
  EXPECT_NE(refusal_of(bytes, dir.path()).find("weights are missing"), std::string::npos);
  const auto weights = read_file(golden("onnx/newer") / "network.onnx.data");
  std::ofstream(dir / "network.onnx.data", std::ios::binary)
      .write(reinterpret_cast<const char*>(weights.data()), static_cast<std::streamsize>(weights.size() - 8));
  EXPECT_NE(refusal_of(bytes, dir.path()).find("beyond the end"), std::string::npos);
  EXPECT_NE(refusal_of(with(bytes, "network.onnx.data", "../network.onnx.d"), dir.path()).find("no file beside it"),
            std::string::npos);
}

TEST(NetworkOnnx, MutationsAreReadOrRefused) {
  const fs::path beside = golden("onnx/older");
  const auto whole = graph_bytes();
  std::mt19937 random(13);
  int refused = 0, read_well = 0;
  for (int n = 0; n < mutations(); ++n) {
    auto bytes = whole;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int c = 0; c < changes; ++c) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    if (n % 2 == 0) bytes[random() % 3000] = static_cast<std::byte>(random());
    if (n % 5 == 0) bytes.resize(random() % bytes.size());
    try {
      const NetworkSteps steps = read_onnx(bytes, beside, 3, {8, 16, 16});
      EXPECT_LE(steps.weight_bytes, 4 * bytes.size());
      ++read_well;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::corrupt);
      ++refused;
    }
  }
  EXPECT_GT(refused, 400);
  EXPECT_GT(read_well, 100);
}

}  // namespace
}  // namespace osteo
