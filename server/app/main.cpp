#include <cstdio>
#include <exception>

#include "server/app/app.h"

int main(int argc, char** argv) {
    int exit_code = 0;
    const auto options = gonio::parse_options({argv + 1, argv + argc}, exit_code);
    if (!options) return exit_code;
    try {
        return gonio::run_daemon(*options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "goniod: %s\n", error.what());
        return 69;  // EX_UNAVAILABLE
    }
}
