// What the readers of request targets and configuration files promise, whatever the bytes. Shared by the fuzz targets
// and their replay test.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

#include "protocol/schema/upload_name.h"
#include "server/app/config.h"
#include "server/app/option_checks.h"
#include "server/http/http_target.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_target(std::string_view text) {
    const auto target = parse_target(text);
    if (!target) return require(!target.error().code.empty() && !target.error().message.empty());
    require(text.size() <= kMaxTargetBytes && target->path.starts_with('/') && target->query.size() <= kMaxParameters);
    for (const char c : target->path) require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7F);
    if (const auto name = upload_name(*target); name && is_upload_name(*name))
        require(name->find('/') == std::string::npos && *name != "." && *name != "..");
    if (!is_still(*target)) return;
    const auto query = still_query(*target);
    if (!query) return require(!query.error().code.empty() && !query.error().message.empty());
    require(query->format() == "png" || query->format() == "jpg" || query->format() == "exr");
    require((query->width_px() == 0) == (query->height_px() == 0));
    v1::CaptureQuery again;
    require(again.ParseFromString(query->SerializeAsString()));
}

// The text as a configuration file of a program with an option of each kind: it is refused with its place, or the
// command line that it completes is one that the program takes.
inline void check_config(std::string_view text) {
    const int file = memfd_create("config", MFD_CLOEXEC);
    require(file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
    CLI::App app;
    std::string config, scene, listen = "127.0.0.1:8080";
    double fps = 60;
    unsigned clients = 64;
    bool debug = false;
    std::vector<std::string> boxes;
    app.add_option("--config", config)->configurable(false);
    app.add_option("--scene", scene);
    app.add_option("--listen", listen);
    app.add_option("--target-fps", fps)->check(finite_in(1, 1000));
    app.add_option("--max-clients", clients);
    app.add_option("--box", boxes);
    app.add_flag("--gl-debug", debug);
    const std::vector<std::string> arguments = {"--config=/proc/self/fd/" + std::to_string(file)};
    app.parse(std::vector<std::string>(arguments));
    const Settings settings = complete_settings(app, arguments, nullptr);
    close(file);
    for (const std::string& error : settings.errors) require(!error.empty());
    if (!settings.errors.empty()) return;
    std::vector<std::string> completed(settings.arguments.rbegin(), settings.arguments.rend());
    app.clear();
    app.parse(completed);  // throws where it is wrong: a finding
    require(fps >= 1 && fps <= 1000);
    print_settings(app, settings);
}

}  // namespace gonio::fuzz
