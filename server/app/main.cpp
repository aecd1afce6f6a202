#include <exception>

#include "server/app/app.h"
#include "server/app/doctor.h"
#include "server/app/log.h"

int main(int argc, char** argv) {
    int exit_code = 0;
    const auto options = gonio::parse_options({argv + 1, argv + argc}, exit_code);
    if (!options) return exit_code;
    try {
        return options->doctor ? gonio::run_doctor(*options) : gonio::run_daemon(*options);
    } catch (const std::exception& error) {
        gonio::log_end(*options, error.what());
        return 69;  // EX_UNAVAILABLE
    }
}
