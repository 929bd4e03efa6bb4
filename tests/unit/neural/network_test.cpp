// Against nnunetv2: what tests/neural/make_golden.py wrote.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>

#include "golden.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/simd.h"
#include "osteo/imaging/neural/detail/conv_kernel.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/windows.h"
#include "scratch.h"

namespace osteo {
namespace {

TEST(NetworkGolden, Plain) {
  const Agreement a = agreement("plain", "plain");
  EXPECT_GE(a.found, 3);
  EXPECT_LE(a.worst, 1e-3);
  EXPECT_LE(a.mean, 2e-6);
  EXPECT_GE(a.labels, 0.9999);
}

TEST(NetworkGolden, Residual) {
  const Agreement a = agreement("residual", "residual");
  EXPECT_GE(a.found, 3);
  EXPECT_LE(a.worst, 1e-3);
  EXPECT_LE(a.mean, 2e-6);
  EXPECT_GE(a.labels, 0.9999);
}

TEST(NetworkGolden, Flat) {
  const Agreement a = agreement("flat", "flat");
  EXPECT_GE(a.found, 2);
  EXPECT_LE(a.worst, 1e-3);
  EXPECT_LE(a.mean, 2e-6);
  EXPECT_GE(a.labels, 0.9999);
}

const std::string kSecondStage = "cascade/nnUNetTrainer__nnUNetPlans__3d_cascade_fullres";

TEST(NetworkGolden, Cascade) {
  const Agreement a = agreement(kSecondStage, kSecondStage);
  EXPECT_EQ(a.found, 4);
  EXPECT_LE(a.worst, 1e-3);
  EXPECT_LE(a.mean, 2e-6);
  EXPECT_GE(a.labels, 0.9999);
}

// The stage before is found beside it by its name, with a slash at the end and without, and is asked for where it
// lacks.
TEST(NetworkGolden, ACascadeNeedsItsFirstStage) {
  const test::ScratchFolder dir;
  const fs::path from = golden(kSecondStage), to = dir.path() / "T__P__3d_cascade_fullres";
  fs::copy(from, to, fs::copy_options::recursive);
  const Image ct = load_image(from / "image.nrrd");
  NetworkParams quick;
  quick.mirror = false;
  try {
    static_cast<void>(segment_with_network(ct, to, quick));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::no_input);
    EXPECT_NE(std::string(error.what()).find("T__P__3d_lowres"), std::string::npos) << error.what();
  }
  fs::copy(golden("cascade/nnUNetTrainer__nnUNetPlans__3d_lowres"), dir.path() / "T__P__3d_lowres",
           fs::copy_options::recursive);
  const Context context;
  const Labels got = segment_with_network(ct, to.string() + "/", quick, context).structures;
  EXPECT_TRUE(std::ranges::equal(got.span(), segment_with_network(ct, from, quick).structures.span()));
  int first = 0;
  for (const auto& [key, value] : context.take_report()) first += key.starts_with("first_stage_") ? 1 : 0;
  EXPECT_EQ(first, 3);
  // A first stage of other labels gives another result: it is used.
  fs::remove_all(dir.path() / "T__P__3d_lowres/fold_0");
  fs::copy(from / "fold_0", dir.path() / "T__P__3d_lowres/fold_0", fs::copy_options::recursive);
  EXPECT_THROW(static_cast<void>(segment_with_network(ct, to, quick)), Error);
}

TEST(NetworkGrid, LabelsTakeTheLargestShareAndTheNearestOfEqualOnes) {
  const std::vector<std::int16_t> labels{0, 3, 1, 1};
  const Axes size{1, 1, 4};
  EXPECT_EQ(resample_labels(labels, size, size, -1, {}), labels);
  EXPECT_EQ(resample_labels(labels, size, {1, 1, 8}, -1, {}), (std::vector<std::int16_t>{0, 0, 3, 3, 1, 1, 1, 1}));
  // The middle of a pair lies between both: the nearest voxel of scipy is the upper one.
  EXPECT_EQ(resample_labels(labels, size, {1, 1, 2}, -1, {}), (std::vector<std::int16_t>{3, 1}));
  EXPECT_EQ(resample_labels({3, 0}, {1, 1, 2}, {1, 1, 1}, -1, {}), (std::vector<std::int16_t>{0}));
  // Three around a corner: 1 and 2 have half each less what 3 has; the nearest is neither, so the smaller is taken.
  EXPECT_EQ(resample_labels({3, 1, 1, 1, 2, 2, 2, 3}, {2, 2, 2}, {1, 1, 1}, -1, {}), (std::vector<std::int16_t>{1}));
  // Along the separate axis nothing is mixed.
  EXPECT_EQ(resample_labels({5, 2, 2}, {3, 1, 1}, {2, 1, 1}, 0, {}), (std::vector<std::int16_t>{5, 2}));
}

TEST(NetworkBits, AreTheSameForAnyNumberOfThreads) {
  NetworkModel model;
  const Image ct = load_image(golden("residual") / "image.nrrd");
  std::vector<std::uint16_t> first;
  for (const int threads : {1, 2, 5}) {
    Context context;
    context.threads = threads;
    NetworkParams p;
    p.mirror = false;
    const auto logits = network_logits(ct, golden("residual"), model, p, context).values;
    if (first.empty()) first = logits;
    EXPECT_EQ(logits, first) << threads;
  }
}

TEST(NetworkBits, AreTheSameForAnyWidthOfVectors) {
  std::mt19937 random(5);
  const auto numbers = [&](std::size_t n) {
    std::vector<float> v(n);
    for (float& x : v) x = static_cast<float>(random() % 20000) / 1e4F - 1;
    return v;
  };
  // Rows of 1 to 30 outputs, of one block or two, with a stride or none.
  const auto in = numbers(3 * 3 * 64 * kChannels), weights = numbers(2 * 27 * kChannels * kChannels),
             start = numbers(kChannels);
  for (int width = 1; width <= 30; ++width) {
    std::vector<std::vector<float>> results;
    const ConvKernel* const kernels[] = {&conv_kernel_base(), &conv_kernel(),
                                         simd() == Simd::avx512 ? &conv_kernel_avx2() : &conv_kernel()};
    for (const ConvKernel* kernel : kernels) {
      for (const int blocks : {1, 2}) {
        for (const int step : {1, 2}) {
          std::vector<float> out(2 * 30 * kChannels, 0.25F);
          ConvRow r;
          r.in = in.data();
          r.in_step = step * kChannels;
          r.in_pixel = kChannels;
          r.in_row = 64 * kChannels;
          r.in_plane = 3 * r.in_row;
          r.channels = 11;
          r.kernel[0] = r.kernel[1] = r.kernel[2] = 3;
          for (int b = 0; b < blocks; ++b) {
            r.weights[b] = weights.data() + b * 27 * kChannels * 11;
            r.out[b] = out.data() + b * 30 * kChannels;
          }
          r.start[0] = start.data();
          r.out_step = kChannels;
          r.width = width;
          kernel->row(r);
          kernel->scale(out.data(), width, start.data(), weights.data(), nullptr, 0.01F);
          std::vector<double> sum(kChannels, 0.0);
          kernel->sum(out.data(), width, nullptr, sum.data());
          kernel->sum(out.data(), width, start.data(), sum.data());
          for (const double v : sum) out.push_back(static_cast<float>(v));
          results.push_back(out);
        }
      }
    }
    for (std::size_t n = 4; n < results.size(); ++n) EXPECT_EQ(results[n], results[n % 4]) << width << " " << n;
    // The first output by hand.
    float by_hand = start[0];
    for (int tap = 0; tap < 27; ++tap) {
      for (int c = 0; c < 11; ++c)
        by_hand += in[static_cast<std::size_t>(((tap / 9 * 3 + tap / 3 % 3) * 64 + tap % 3) * kChannels + c)] *
                   weights[static_cast<std::size_t>((tap * 11 + c) * kChannels)];
    }
    by_hand = by_hand * start[0] + weights[0];
    EXPECT_NEAR(results[0][0], by_hand > 0 ? by_hand : by_hand * 0.01F, 1e-4);
  }
}

TEST(NetworkParams, AreFollowedOrRefused) {
  const Image ct = load_image(golden("plain") / "image.nrrd");
  NetworkModel model;
  NetworkParams p;
  p.mirror = false;
  const auto logits = [&] { return network_logits(ct, golden("plain"), model, p, {}).values; };
  const auto all = logits();
  p.folds = {1};
  const auto one = logits();
  EXPECT_NE(one, all);
  p.step = 1;
  EXPECT_NE(logits(), one);
  const auto code = [&](const fs::path& folder) {
    try {
      static_cast<void>(segment_with_network(ct, folder, p));
    } catch (const Error& error) {
      return error.code();
    }
    return ExitCode::ok;
  };
  EXPECT_EQ(code(golden("none")), ExitCode::no_input);
  EXPECT_EQ(code(golden("plain") / "fold_0"), ExitCode::no_input);
  p.max_memory_gb = 1e-4;
  EXPECT_EQ(code(golden("plain")), ExitCode::resources);
  p.folds = {7};
  EXPECT_EQ(code(golden("plain")), ExitCode::usage);
  p.folds = {};
  p.step = 0;
  EXPECT_EQ(code(golden("plain")), ExitCode::usage);
}

TEST(NetworkParams, CancelEndsIt) {
  Context context;
  std::atomic<bool> stop{true};
  context.set_cancel_flag(&stop);
  const Image ct = load_image(golden("flat") / "image.nrrd");
  EXPECT_THROW(static_cast<void>(segment_with_network(ct, golden("flat"), {}, context)), Error);
}

std::string refusal(const std::string& from, const std::string& to, bool of_plans = true) {
  std::string plans = read_text(golden("residual") / "plans.json"),
              data = read_text(golden("residual") / "dataset.json");
  std::string& text = of_plans ? plans : data;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  try {
    static_cast<void>(read_network_model(plans, data, "3d_lowres"));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::corrupt);
    return error.what();
  }
  return "";
}

TEST(NetworkPlans, WhatIsNotSupportedIsNamed) {
  EXPECT_EQ(refusal("\"batch_size\": 2", "\"batch_size\": 3"), "");
  EXPECT_NE(refusal("unet.ResidualEncoderUNet", "primus.Primus").find("Primus"), std::string::npos);
  EXPECT_NE(refusal("torch.nn.LeakyReLU", "torch.nn.GELU").find("nonlin"), std::string::npos);
  EXPECT_EQ(refusal("\"batch_size\"", "\"previous_stage\": \"3d_fullres\", \"x\""), "");
  EXPECT_NE(refusal("\"batch_size\"", "\"previous_stage\": \"../secret\", \"x\"").find("previous_stage"),
            std::string::npos);
  EXPECT_NE(refusal("CTNormalization", "RGBTo01Normalization").find("RGB"), std::string::npos);
  EXPECT_NE(refusal("SimpleITKIO", "NibabelIOWithReorient").find("Reorient"), std::string::npos);
  EXPECT_NE(refusal("resample_data_or_seg_to_shape", "resample_torch_fornnunet").find("resampling of data"),
            std::string::npos);
  EXPECT_NE(refusal("\"n_stages\": 3", "\"n_stages\": 4").find("features_per_stage"), std::string::npos);
  EXPECT_NE(refusal("\"patch_size\": [\n    8", "\"patch_size\": [\n    7").find("patch_size"), std::string::npos);
  EXPECT_NE(refusal("regions_class_order", "regions", false).find("regions_class_order"), std::string::npos);
}

}  // namespace
}  // namespace osteo
