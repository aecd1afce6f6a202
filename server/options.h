// Command line of goniod (README.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/net/udp_inputs.h"

namespace gonio {

struct Options {
    std::string scene = "cornell";
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;
    std::string token_file;
    std::string technique = "default";
    std::optional<unsigned> samples;
    int width_px = 800, height_px = 800;
    double target_fps = 60.0;        // no frame is rendered sooner than 1/target_fps after the last
    bool keep_up = false;            // --target-fps was given: frames are made to fit it
    std::string encoder = "auto";    // of H.264: nvenc, vaapi, libx264; mjpeg: none
    unsigned max_private_lanes = 4;  // viewers that have an encoder of their own; all others share one
    std::string gather = "auto";     // gl, simd
    int device = -1;
    std::string renderer = "gl";     // null: grey pictures without GL, for tests
    std::string oneshot, out = ".";  // JOB.json and the folder its captures go to; empty: serve
    bool gl_debug = false;
    InputOptions inputs;             // of consoles; all off unless asked for: these protocols know no passwords
    std::string patch_file;          // TOML; empty: the default patch
    bool surfaces = true;            // look for fader boxes
    std::string midi = "auto";       // usb, alsa
    std::vector<std::string> boxes;  // VVVV:PPPP or VVVV:PPPP=PROFILE
    std::string surface_map;         // TOML; empty: what the profiles of the boxes say
    std::string surface_replay;      // a recorded box; empty: none
    std::string state_file;          // where the show is kept between two runs; empty: nowhere
    bool scene_given = false, size_given = false, technique_given = false;  // else the saved show's
    std::vector<std::string> inject;                                        // faults, for tests (server/gpu.h)
};

// Result: the options; nothing if the program is to end with `exit_code` (help was printed, or an argument is wrong).
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gonio
