// Options of goniod: command line, environment and configuration file (docs/operations.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/app/bake_options.h"
#include "server/assets/assets.h"
#include "server/http/http_limits.h"
#include "server/inputs/udp_inputs.h"

namespace gonio {

struct Options {
    std::string scene = "cornell";
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;
    std::string token_file, viewer_token_file;
    std::string technique = "default";
    std::optional<unsigned> samples;
    int width_px = 800, height_px = 800;
    double target_fps = 60.0;           // no frame is rendered sooner than 1/target_fps after the last
    bool keep_up = false;               // --target-fps was given: frames are made to fit it
    std::string encoder = "auto";       // of H.264: nvenc, vaapi, libx264; mjpeg: none
    unsigned max_private_lanes = 4;     // viewers that have an encoder of their own; all others share one
    std::string direct_light = "auto";  // gl, rays
    int device = -1;
    std::string renderer = "gl";     // null: grey pictures without GL, for tests
    std::string oneshot, out = ".";  // JOB.json and the folder its captures go to; empty: serve
    std::string shard = "0/1";       // of the frames of a job: those whose number leaves 0 by 1
    int threads = 0;                 // 0: as many as processors that it may use
    std::string isa = "auto";        // avx2, avx512
    bool json = false;               // of a job: lines of JSON, also on a terminal
    BakeOptions bake;                // likewise with maps
    bool gl_debug = false;
    InputOptions inputs;             // of consoles; all off unless asked for: these protocols know no passwords
    std::string patch_file;          // TOML; empty: the default patch
    bool surfaces = true;            // look for fader boxes
    std::string midi = "auto";       // usb, alsa
    std::vector<std::string> boxes;  // VVVV:PPPP or VVVV:PPPP=PROFILE
    std::string surface_map;         // TOML; empty: what the profiles of the boxes say
    std::string surface_replay;      // a recorded box; empty: none
    std::string follow;              // URL of the server that this one follows; empty: none
    std::string follow_token_file, follow_ca;
    std::vector<std::string> beside_follow;  // options that were given though the leader says what they say
    std::string state_file;                  // where the show is kept between two runs; empty: nowhere
    std::string show_folder;                 // of the shows that clients save; empty: beside the state file
    std::string gel_file;                    // empty: the built-in gels alone
    bool scene_given = false, scale_given = false, size_given = false,
         technique_given = false;                          // else the saved show's
    std::vector<std::string> inject;                       // faults, for tests (server/session/gpu.h)
    std::string tls_certificate, tls_key;                  // PEM files; both or none
    std::vector<std::string> host_names, origins;          // that requests may come for, and from
    std::string upload_folder;                             // empty: a private one
    std::vector<std::string> scene_roots;                  // below which clients may load scene files
    std::vector<std::string> library_folders;              // of photometric files
    std::string log_level = "info", log = "text";          // json: a line of JSON for each entry
    bool doctor = false;                                   // examine the machine and end (server/app/doctor.h)
    std::vector<std::string> faults;                       // with doctor: what else ends with 78, sentences
    unsigned max_captures = 8;                             // that wait for each other
    std::size_t transport_bytes = std::size_t{256} << 20;  // SurfelSettings::bytes
    std::size_t layer_bytes = std::size_t{2} << 30;        // Renderer::set_layer_bytes
    std::size_t max_memory = 0;                            // of the process, bytes (memory_room); 0: no bound
    LoadOptions load;                                      // of scene files
    HttpLimits limits;
    // Whether it stays, with a network; else it does a job and ends.
    bool serves() const { return oneshot.empty() && bake.scene.empty() && !doctor; }
    std::vector<std::string> arguments;  // as given: SIGHUP reads file and environment again
};

// Result: the options; nothing if the program is to end. Then `exit_code` is 0 (what was asked for was printed), 2 (an
// argument is wrong) or 78 (the configuration file or a variable is). The arguments come without the program's name.
std::optional<Options> parse_options(const std::vector<std::string>& arguments, int& exit_code);

}  // namespace gonio
