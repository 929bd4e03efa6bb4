#include <iostream>

#include "commands.h"

int main(int argc, char** argv) { return osteo::cli::run_program(osteo::osteo_program(), argc, argv, std::cout, std::cerr); }
