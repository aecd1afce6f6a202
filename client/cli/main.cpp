#include <iostream>
#include <string>
#include <vector>

#include "client/cli/cli.h"

int main(int argc, char** argv) {
    const std::vector<std::string> args(argv + (argc > 0 ? 1 : 0), argv + argc);
    try {
        return gonio::run_cli(args, std::cout, std::cerr);
    } catch (const std::exception& exception) {
        std::cerr << "gonio: " << exception.what() << "\n";
        return gonio::kExitRefused;
    }
}
