#include "osteo/imaging/dicom/save_series.h"

#include <vtkDICOMCTGenerator.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMWriter.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline imaging {

void save_dicom_series(const Image& image, const fs::path& folder, const Context& context,
                       const std::function<void(const fs::path&)>& may_replace) {
  write_folder_atomically(folder, may_replace, [&](const fs::path& temporary) {
    const QuietVtk quiet;
    vtkNew<vtkDICOMMetaData> meta;
    meta->Set(DC::PatientName, "OSTEOTOME^PHANTOM");
    meta->Set(DC::PatientID, "OSTEOTOME");
    meta->Set(DC::Modality, "CT");
    meta->Set(DC::SeriesNumber, 1);
    meta->Set(DC::SeriesDescription, "Osteotome volume");
    meta->Set(DC::RescaleSlope, 1.0);
    meta->Set(DC::RescaleIntercept, 0.0);
    meta->Set(DC::RescaleType, "HU");
    meta->Set(DC::SliceThickness, image.frame.spacing_mm.z);
    const auto volume = to_vtk(image);
    volume->SetOrigin(0, 0, 0);
    volume->SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1);
    vtkNew<vtkMatrix4x4> matrix;
    for (int a = 0; a < 3; ++a) {
      for (int r = 0; r < 3; ++r) {
        matrix->SetElement(r, a,
                           image.frame.direction.column[static_cast<std::size_t>(a)][static_cast<std::size_t>(r)]);
      }
      matrix->SetElement(a, 3, image.frame.origin_mm[static_cast<std::size_t>(a)]);
    }
    vtkNew<vtkDICOMCTGenerator> generator;
    vtkNew<vtkDICOMWriter> writer;
    writer->SetGenerator(generator);
    writer->SetMetaData(meta);
    writer->SetInputData(volume);
    writer->SetPatientMatrix(matrix);
    writer->SetMemoryRowOrderToFileNative();
    writer->SetFileSliceOrderToSame();
    writer->SetFilePrefix(temporary.c_str());
    writer->SetFilePattern("%s/%04d.dcm");
    writer->Write();
    if (writer->GetErrorCode() != 0) throw vtk_write_error(folder, writer->GetErrorCode());
    const std::size_t slice_bytes =
        image.frame.voxel_count() / static_cast<std::size_t>(image.frame.dims[2]) * sizeof(std::int16_t);
    for (const auto& entry : fs::directory_iterator(temporary)) {
      // vtk-dicom does not look whether its bytes arrived.
      if (entry.file_size() < slice_bytes) throw vtk_write_error(folder, vtkErrorCode::OutOfDiskSpaceError);
    }
    context.progress(1.0);
  });
}

}  // namespace osteo::inline imaging
