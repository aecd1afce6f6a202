#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "tests/bench/frames.h"
#include "tests/stress/stress.h"

int main(int argc, char** argv) {
    gonio::FramesOptions options;
    std::string size = "800x800";
    CLI::App app{"gonio-bench: measures the renderer"};
    app.require_subcommand(1);
    CLI::App* frames = app.add_subcommand(
        "frames", "frame times of the seed technique and the default one, everything recomputed in each frame");
    frames->add_option("--scene", options.scene, "cornell, atrium or a file; default: both built-in scenes");
    frames->add_option("--size", size, "WIDTHxHEIGHT")
        ->capture_default_str()
        ->check(CLI::Validator(
            [](std::string& text) {
                return text.find('x') == std::string::npos ? std::string("must be WIDTHxHEIGHT") : std::string();
            },
            "WxH"));
    frames->add_option("--seconds", options.seconds, "time per row; at least 5 and at most 50 frames")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str();
    frames->add_option("--device", options.device, "index of the EGL device");
    frames->add_flag("--json", options.json, "print rows as JSON");
    gonio::stress::Options stress;
    CLI::App* const stressed = gonio::stress::add_subcommand(app, stress);
    CLI11_PARSE(app, argc, argv);
    try {
        if (*stressed) return gonio::stress::run_stress(stress, std::cout);
        options.width_px = std::stoi(size);
        options.height_px = std::stoi(size.substr(size.find('x') + 1));
        gonio::run_frames(options, std::cout);
    } catch (const std::exception& error) {
        std::cerr << "gonio-bench: " << error.what() << "\n";
        return 1;
    }
    return 0;
}
