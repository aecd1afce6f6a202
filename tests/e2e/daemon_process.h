// The real goniod on a free port, driven by the real gonio: what a person types, as a function.
#pragma once

#include <sys/types.h>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace gonio::test {

struct Finished {
    int exit_code = -1;
    std::string out, err;
};

// Runs a program of the build to its end.
Finished run_program(const std::string& name, const std::vector<std::string>& arguments);

// Names of the passes that ran, of a frame's report.
std::set<std::string> passes_ran(const nlohmann::json& report);

// User and system time that a process has used, s.
double cpu_seconds(pid_t pid);
// Result: whether within a minute there is a second in which the process uses less than this share of a core. A program
// that polls never has one. A slow machine only takes longer to finish what was begun.
bool comes_to_rest(pid_t pid, double share);
// Memory of a process that is in RAM, MiB.
double resident_mib(pid_t pid);

// A gonio that was started and is killed at the end of its scope, whatever it does; its output is thrown away.
class KilledClient {
public:
    KilledClient(const std::string& url, std::vector<std::string> words);
    ~KilledClient();
    KilledClient(const KilledClient&) = delete;
    bool ended() const;  // by itself

private:
    pid_t pid_ = -1;
};

// Result: of a URL such as http://127.0.0.1:8470.
inline std::uint16_t port_of(const std::string& url) {
    return static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
}

// Its log (stderr) is shown at the end of a test that failed.
class DaemonProcess {
public:
    // Starts goniod with the arguments and waits for its READY line (60 s). Unless they say otherwise it has --listen
    // 127.0.0.1:0, --max-transport-mib 16 (coarse later bounces, which take a tenth of the time), and --renderer null:
    // a test that looks at light or at passes says --renderer gl. meanwhile: called again and again until then.
    explicit DaemonProcess(std::vector<std::string> arguments = {}, const std::function<void(pid_t)>& meanwhile = {});
    ~DaemonProcess();
    DaemonProcess(const DaemonProcess&) = delete;

    const std::string& url() const { return url_; }
    bool alive() const;
    pid_t pid() const { return pid_; }
    // Sends SIGTERM; result: the exit code, or -1 if it did not end within 5 s.
    int stop();
    // What it has logged so far; also after stop().
    std::string log() const;

    Finished gonio(std::vector<std::string> words) const;
    // The command must succeed; result: its output as JSON (with --json).
    nlohmann::json json(std::vector<std::string> words) const;
    // Waits up to a minute, as a busy machine or a sanitizer needs, until every bounce is there. Result: whether it is.
    bool transport_ready() const;
    // A set command that must succeed; result: the scene_rev it printed.
    unsigned rev(std::vector<std::string> words) const;

private:
    std::string ready_line(const std::function<void(pid_t)>& meanwhile) const;
    void end(bool show_log);

    std::string url_;
    pid_t pid_ = -1;
    int out_fd_ = -1, log_fd_ = -1;
};

// A folder that is removed with its content.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    std::string file(const std::string& name, const std::string& content) const;  // written; result: its path
    std::string path(const std::string& name) const { return folder_ + "/" + name; }

private:
    std::string folder_;
};

// A 20 m floor of the reflectance given at y = 0 with one isotropic 1000 cd luminaire 2 m above it (EXT_lights_ies), a
// camera that looks straight down from 6 m.
std::string floor_gltf(double reflectance);
std::string isotropic_ies(double candela);

}  // namespace gonio::test
