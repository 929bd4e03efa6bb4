// A pipeline file of Osteotome in a window of VTK: surface of the bone, as the step "surface" makes it.
//   vtk_render pipelines/temporal-bone.json CT [PICTURE.png]
#include <vtkActor.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkWindowToImageFilter.h>

#include <iostream>

#include "osteo/app/stages/registry.h"
#include "osteo/app/vtk/pipeline.h"
#include "osteo/core/base/error.h"

int main(int argc, char** argv) try {
  if (argc < 3) throw osteo::Error(osteo::ExitCode::usage, "vtk_render PIPELINE.json CT [PICTURE.png]");
  const osteo::Registry stages = osteo::osteo_stages();
  osteo::VtkPipeline pipeline = osteo::load_vtk_pipeline(argv[1], {{"source", argv[2]}, {"case", "case"}}, stages);
  pipeline.step("mask")->SetParameter("lower", "500");
  pipeline.update("surface");  // throws, with file, line and step, what Update() would only print

  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(pipeline.output("surface"));
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(0.9, 0.85, 0.75);
  vtkNew<vtkRenderer> renderer;
  renderer->AddActor(actor);
  renderer->ResetCamera();
  vtkNew<vtkRenderWindow> window;
  window->SetSize(640, 480);
  window->AddRenderer(renderer);
  if (argc > 3) {
    vtkNew<vtkWindowToImageFilter> picture;
    picture->SetInput(window);
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(picture->GetOutputPort());
    writer->SetFileName(argv[3]);
    writer->Write();
  } else {
    vtkNew<vtkRenderWindowInteractor> interactor;
    vtkNew<vtkInteractorStyleTrackballCamera> style;
    interactor->SetInteractorStyle(style);
    interactor->SetRenderWindow(window);
    interactor->Start();
  }
} catch (const osteo::Error& e) {
  std::cerr << e.what() << (e.advice().empty() ? "" : ": ") << e.advice() << '\n';
  return static_cast<int>(e.code());
}
