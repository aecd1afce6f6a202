#include "server/options.h"

#include <CLI/CLI.hpp>

namespace gonio {

std::optional<Options> parse_options(int argc, char** argv, int& exit_code) {
    Options options;
    std::string listen = "127.0.0.1:8080", size = "800x800";
    unsigned samples = 0;
    CLI::App app{"goniod: headless lighting-previsualisation server"};
    app.set_version_flag("--version", "goniod " GONIO_VERSION);
    app.add_option("--scene", options.scene, "cornell, atrium, or a .gltf or .glb file")->capture_default_str();
    app.add_option("--listen", listen, "HOST:PORT; port 0 picks a free one")->capture_default_str();
    app.add_option("--token-file", options.token_file, "file that holds the bearer token clients must show");
    app.add_option("--device", options.device, "index of the EGL device; default: the first that works");
    app.add_option("--technique", options.technique, "default, seed or seed-disk")->capture_default_str();
    app.add_option("--samples", samples, "VPLs of default (16..4096), directions per fragment of seed (1..4096)");
    app.add_option("--size", size, "WIDTHxHEIGHT of the picture, even, 16..4096")->capture_default_str();
    app.add_option("--target-fps", options.target_fps, "upper bound of the frame rate")
        ->check(CLI::Range(1.0, 1000.0))
        ->capture_default_str();
    app.add_option("--gather", options.gather,
                   "where direct light is shaded: gl (shadow maps), simd (rays on the CPU), auto")
        ->check(CLI::IsMember({"auto", "gl", "simd"}))
        ->capture_default_str();
    app.add_option("--oneshot", options.oneshot, "JOB.json: capture its frames and end, without a network");
    app.add_option("--out", options.out, "folder for the captures of --oneshot")->capture_default_str();
    app.add_flag("--gl-debug", options.gl_debug, "count and print GL debug messages");
    try {
        app.parse(argc, argv);
        const std::size_t colon = listen.rfind(':');
        if (colon == std::string::npos || colon == 0)
            throw CLI::ValidationError("--listen", "must be HOST:PORT, not '" + listen + "'");
        options.host = listen.substr(0, colon);
        if (options.host.front() == '[' && options.host.back() == ']')
            options.host = options.host.substr(1, options.host.size() - 2);
        unsigned port = 0;
        if (!CLI::detail::lexical_cast(listen.substr(colon + 1), port) || port > 65535) {
            throw CLI::ValidationError("--listen", "the port must be 0..65535, not '" + listen.substr(colon + 1) + "'");
        }
        options.port = static_cast<std::uint16_t>(port);
        const std::size_t x = size.find('x');
        if (x == std::string::npos || !CLI::detail::lexical_cast(size.substr(0, x), options.width_px) ||
            !CLI::detail::lexical_cast(size.substr(x + 1), options.height_px)) {
            throw CLI::ValidationError("--size", "must be WIDTHxHEIGHT, not '" + size + "'");
        }
        if (app.count("--samples") > 0) options.samples = samples;
    } catch (const CLI::ParseError& error) {
        exit_code = app.exit(error) == 0 ? 0 : 2;
        return std::nullopt;
    }
    return options;
}

}  // namespace gonio
