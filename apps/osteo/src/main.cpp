#include <iostream>

#include "program.h"

int main(int argc, char** argv) {
  osteo::cli::Program program = osteo::make_osteo_program();
  return osteo::cli::run_program(program, argc, argv, std::cout, std::cerr);
}
