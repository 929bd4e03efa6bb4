// What we write is, byte for byte, what OpenIGTLink's own library writes, and what it reads. Where it is installed.
#include <gtest/gtest.h>

#include "osteo/network/wire/igtl.h"
#ifdef OSTEO_WITH_OPENIGTLINK
#include <igtlNDArrayMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>
#endif

namespace osteo {
namespace {

#ifdef OSTEO_WITH_OPENIGTLINK

template <class M>
WireBytes packed(M& m, const char* device, unsigned seconds, unsigned fraction) {
  m->SetDeviceName(device);
  m->SetTimeStamp(seconds, fraction);
  m->Pack();
  const auto* const p = static_cast<const std::uint8_t*>(m->GetPackPointer());
  return {p, p + m->GetPackSize()};
}

TEST(IgtlLibrary, WritesTheSameBytes) {
  const IgtlPose pose{{{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}}, Vec3{1.5, -2, 300}};
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  for (int c = 0; c < 3; ++c) {
    const Vec3 v = pose.axes.column[static_cast<std::size_t>(c)];
    matrix[0][c] = static_cast<float>(v.x);
    matrix[1][c] = static_cast<float>(v.y);
    matrix[2][c] = static_cast<float>(v.z);
  }
  matrix[0][3] = 1.5F;
  matrix[1][3] = -2;
  matrix[2][3] = 300;
  auto transform = igtl::TransformMessage::New();
  transform->SetMatrix(matrix);
  EXPECT_EQ(igtl_transform("Tool", 7.5, pose), packed(transform, "Tool", 7, 0x80000000U));

  auto tracking = igtl::TrackingDataMessage::New();
  for (const char* const name : {"Tool", "Tool2"}) {
    auto element = igtl::TrackingDataElement::New();
    element->SetName(name);
    element->SetType(igtl::TrackingDataElement::TYPE_6D);
    element->SetMatrix(matrix);
    tracking->AddTrackingDataElement(element);
  }
  // The library leaves the byte that is reserved as its memory was, and its checksum with it.
  WireBytes ours = igtl_tracking("Tools", 7.5, std::vector<IgtlTool>{{"Tool", pose}, {"Tool2", pose}});
  WireBytes theirs = packed(tracking, "Tools", 7, 0x80000000U);
  ASSERT_EQ(theirs.size(), 58u + 2 * 70);
  for (const std::size_t element : {0u, 1u}) theirs[58 + 70 * element + 21] = 0;
  for (WireBytes* const m : {&ours, &theirs}) m->erase(m->begin() + 50, m->begin() + 58);
  EXPECT_EQ(ours, theirs);

  auto sensor = igtl::SensorMessage::New();
  sensor->SetLength(3);
  double values[] = {1, -2.5, 1e-3};
  sensor->SetValue(values);
  sensor->SetUnit(kIgtlNewton);
  EXPECT_EQ(igtl_sensor("Force", 0, kIgtlNewton, values), packed(sensor, "Force", 0, 0));

  auto text = igtl::StringMessage::New();
  text->SetString("burst, oris");
  EXPECT_EQ(igtl_string("NerveEvent", 0, "burst, oris"), packed(text, "NerveEvent", 0, 0));

  auto status = igtl::StatusMessage::New();
  status->SetCode(igtl::StatusMessage::STATUS_OVERFLOW);
  status->SetSubCode(-3);
  status->SetErrorName("dropped");
  status->SetStatusString("too slow");
  EXPECT_EQ(igtl_status("Osteotome", 0, IgtlStatus::overflow, -3, "dropped", "too slow"),
            packed(status, "Osteotome", 0, 0));

  const auto word = [](unsigned char name) {
    auto unit = igtl::Unit::New();
    unit->Append(name, 1);
    return unit->Pack();
  };
  EXPECT_EQ(word(igtl::Unit::SI_DERIVED_NEWTON), kIgtlNewton);
  EXPECT_EQ(word(igtl::Unit::SI_DERIVED_HERTZ), kIgtlHertz);
}

// Of arrays the library keeps its values as the machine has them; so it is asked to read ours.
TEST(IgtlLibrary, ReadsOurArrays) {
  const std::vector<std::int16_t> samples{1, -2, 32764, -32768, 5, 6};
  const WireBytes ours = igtl_samples("NerveSignal", 0, 2, samples);
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  std::copy_n(ours.begin(), header->GetPackSize(), static_cast<std::uint8_t*>(header->GetPackPointer()));
  header->Unpack();
  auto array = igtl::NDArrayMessage::New();
  array->SetMessageHeader(header);
  array->AllocatePack();
  ASSERT_EQ(array->GetPackBodySize(), static_cast<int>(ours.size() - 58));
  std::copy(ours.begin() + 58, ours.end(), static_cast<std::uint8_t*>(array->GetPackBodyPointer()));
  ASSERT_NE(array->Unpack(1) & igtl::MessageHeader::UNPACK_BODY, 0) << "its checksum too";
  ASSERT_EQ(array->GetType(), igtl::NDArrayMessage::TYPE_INT16);
  EXPECT_EQ(array->GetArray()->GetSize(), (std::vector<igtlUint16>{3, 2}));
  const auto* const raw = static_cast<const std::int16_t*>(array->GetArray()->GetRawArray());
  EXPECT_EQ(std::vector<std::int16_t>(raw, raw + 6), samples);
}

#else
TEST(IgtlLibrary, WritesTheSameBytes) {
  GTEST_SKIP() << "libopenigtlink-dev is not installed";
}
#endif

}  // namespace
}  // namespace osteo
