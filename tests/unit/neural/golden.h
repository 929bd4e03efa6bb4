// What nnunetv2 made of seeded networks and images (tests/neural/make_golden.py), and how far this agrees with it.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

#include "folders.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/imaging/neural/detail/half.h"
#include "osteo/imaging/neural/detail/predict.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo {

inline fs::path golden(const std::string& name) {
  return source_folder() / "testdata/neural" / name;
}

/// Of a damaged file: more of them by OSTEO_MUTATIONS, for a run by hand.
inline int mutations() {
  const char* const given = std::getenv("OSTEO_MUTATIONS");
  return given != nullptr ? std::atoi(given) : 1500;
}

struct Agreement {
  double worst = 0, labels = 0, mean = 0, largest = 0;
  int found = 0;
};

/// `of`: the folder that holds the image and what nnunetv2 made of it.
inline Agreement agreement(const std::string& name, const std::string& of, const NetworkParams& params = {}) {
  const fs::path folder = golden(name);
  const Image ct = load_image(golden(of) / "image.nrrd");
  const Labels wanted = load_labels(golden(of) / "labels.nrrd");
  NetworkModel model;
  const NetworkLogits logits = network_logits(ct, folder, model, params, {});
  const auto bytes = read_file(golden(of) / "logits.f16");
  EXPECT_EQ(bytes.size(), 2 * logits.values.size());
  Agreement a;
  for (std::size_t n = 0; n < std::min(logits.values.size(), bytes.size() / 2); ++n) {
    const auto half =
        static_cast<std::uint16_t>(static_cast<unsigned>(bytes[2 * n]) | static_cast<unsigned>(bytes[2 * n + 1]) << 8);
    const auto want = static_cast<double>(float_from_half(half)),
               got = static_cast<double>(float_from_half(logits.values[n]));
    a.worst = std::max(a.worst, std::abs(want - got));
    a.mean += std::abs(want - got) / static_cast<double>(logits.values.size());
    a.largest = std::max(a.largest, std::abs(want));
  }
  const Labels got = segment_with_network(ct, folder, params).structures;
  EXPECT_EQ(got.frame, ct.frame);
  std::size_t same = 0;
  std::set<int> found;
  for (std::size_t n = 0; n < wanted.span().size(); ++n) {
    same += got.span()[n] == wanted.span()[n] ? 1 : 0;
    found.insert(wanted.span()[n]);
  }
  a.labels = static_cast<double>(same) / static_cast<double>(wanted.span().size());
  a.found = static_cast<int>(found.size());
  std::printf("%s: labels equal %.5f %%, logits differ by %.6f at most, %.8f on average, of %.3f\n", name.c_str(),
              100 * a.labels, a.worst, a.mean, a.largest);
  return a;
}

}  // namespace osteo
