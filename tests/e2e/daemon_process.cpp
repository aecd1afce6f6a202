#include "tests/e2e/daemon_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace gonio::test {
namespace {

std::string program_path(const std::string& name) {
    const char* folder = std::getenv("GONIO_BIN");
    return folder != nullptr ? std::string(folder) + "/" + name
                             : (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

struct Spawned {
    pid_t pid;
    int out, err;
};

// err: the read end of a pipe, or with `to_file` a file in memory that has all of it.
Spawned spawn(const std::string& name, const std::vector<std::string>& arguments, bool to_file = false) {
    const std::string path = program_path(name);
    std::vector<char*> argv = {const_cast<char*>(path.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    int out[2], err[2];
    if (to_file) err[0] = err[1] = memfd_create("log", MFD_CLOEXEC);
    if (pipe2(out, O_CLOEXEC) != 0 || (to_file ? err[0] < 0 : pipe2(err, O_CLOEXEC) != 0))
        throw std::runtime_error("pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    posix_spawn_file_actions_adddup2(&actions, err[1], 2);
    pid_t pid = -1;
    const int failed = posix_spawn(&pid, path.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(out[1]);
    if (!to_file) close(err[1]);
    if (failed != 0) throw std::runtime_error("cannot start " + path);
    return {pid, out[0], err[0]};
}

}  // namespace

Finished run_program(const std::string& name, const std::vector<std::string>& arguments) {
    const Spawned process = spawn(name, arguments);
    Finished result;
    std::array<pollfd, 2> fds = {pollfd{process.out, POLLIN, 0}, pollfd{process.err, POLLIN, 0}};
    for (int open = 2; open > 0;) {
        poll(fds.data(), 2, -1);
        for (int i = 0; i < 2; ++i) {
            if (fds[i].fd < 0 || fds[i].revents == 0) continue;
            char buffer[65536];
            const ssize_t n = read(fds[i].fd, buffer, sizeof buffer);
            if (n > 0) {
                (i == 0 ? result.out : result.err).append(buffer, static_cast<std::size_t>(n));
            } else {
                close(fds[i].fd);
                fds[i].fd = -1;
                --open;
            }
        }
    }
    int status = 0;
    waitpid(process.pid, &status, 0);
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
}

std::set<std::string> passes_ran(const nlohmann::json& report) {
    std::set<std::string> names;
    for (const nlohmann::json& pass : report["passes"])
        if (pass["state"] == "ran") names.insert(pass["name"]);
    return names;
}

double cpu_seconds(pid_t pid) {
    clockid_t clock{};
    timespec time{};
    EXPECT_EQ(clock_getcpuclockid(pid, &clock), 0);
    EXPECT_EQ(clock_gettime(clock, &time), 0);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool comes_to_rest(pid_t pid, double share) {
    for (int second = 0; second < 60; ++second) {
        const double before_s = cpu_seconds(pid);
        std::this_thread::sleep_for(std::chrono::seconds(1));
        if (cpu_seconds(pid) - before_s < share) return true;
    }
    return false;
}

double resident_mib(pid_t pid) {
    double size = 0, resident = 0;
    std::ifstream("/proc/" + std::to_string(pid) + "/statm") >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

KilledClient::KilledClient(const std::string& url, std::vector<std::string> words) {
    words.insert(words.begin(), {"--server", url});
    const Spawned process = spawn("gonio", words);
    pid_ = process.pid;
    close(process.out);
    close(process.err);
}

KilledClient::~KilledClient() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
}

bool KilledClient::ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid_;
}

DaemonProcess::DaemonProcess(std::vector<std::string> arguments, const std::function<void(pid_t)>& meanwhile) {
    for (const auto& [option, value] : {std::pair("--listen", "127.0.0.1:0"), std::pair("--max-transport-mib", "16")}) {
        if (std::find(arguments.begin(), arguments.end(), option) == arguments.end())
            arguments.insert(arguments.begin(), {option, value});
    }
    const auto named = std::find(arguments.begin(), arguments.end(), "--renderer");
    // Under ThreadSanitizer no GL runs: its drivers are not made for it.
    if (const char* other = std::getenv("GONIO_TEST_RENDERER"); other != nullptr && named != arguments.end())
        *(named + 1) = other;
    if (named == arguments.end()) arguments.insert(arguments.end(), {"--renderer", "null"});
    const Spawned process = spawn("goniod", arguments, true);
    pid_ = process.pid;
    out_fd_ = process.out;
    log_fd_ = process.err;
    try {
        const std::string line = ready_line(meanwhile);
        if (line.rfind("READY http://", 0) != 0 && line.rfind("READY https://", 0) != 0)
            throw std::runtime_error("unexpected first line: " + line);
        url_ = line.substr(6);
    } catch (const std::exception&) {
        end(true);
        throw;
    }
}

std::string DaemonProcess::ready_line(const std::function<void(pid_t)>& meanwhile) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (std::string line;;) {
        pollfd ready{out_fd_, POLLIN, 0};
        if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("goniod printed no READY line");
        if (meanwhile) meanwhile(pid_);
        if (poll(&ready, 1, meanwhile ? 2 : 200) <= 0) continue;
        char c;
        if (read(out_fd_, &c, 1) != 1) throw std::runtime_error("goniod ended before READY");
        if (c == '\n') return line;
        line += c;
    }
}

DaemonProcess::~DaemonProcess() {
    end(testing::Test::HasFailure());
}

void DaemonProcess::end(bool show_log) {
    if (pid_ > 0 && stop() < 0) {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
    close(out_fd_);
    if (show_log) std::cerr << log();
    close(log_fd_);
}

std::string DaemonProcess::log() const {
    std::string text;
    char buffer[65536];
    for (ssize_t n; (n = pread(log_fd_, buffer, sizeof buffer, static_cast<off_t>(text.size()))) > 0;)
        text.append(buffer, static_cast<std::size_t>(n));
    return text;
}

bool DaemonProcess::alive() const {
    return pid_ > 0 && kill(pid_, 0) == 0;
}

int DaemonProcess::stop() {
    if (pid_ <= 0) return -1;
    kill(pid_, SIGTERM);
    for (int i = 0; i < 500; ++i) {
        int status = 0;
        if (waitpid(pid_, &status, WNOHANG) == pid_) {
            pid_ = -1;
            return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return -1;
}

Finished DaemonProcess::gonio(std::vector<std::string> words) const {
    words.insert(words.begin(), {"--server", url_});
    return run_program("gonio", words);
}

bool DaemonProcess::transport_ready() const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < until) {
        if (json({"stats"}).at("transport_ready").get<bool>()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
}

nlohmann::json DaemonProcess::json(std::vector<std::string> words) const {
    words.insert(words.begin(), "--json");
    const Finished done = gonio(words);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return nlohmann::json::parse(done.out, nullptr, false);
}

unsigned DaemonProcess::rev(std::vector<std::string> words) const {
    const Finished done = gonio(words);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    unsigned number = 0;
    EXPECT_EQ(std::sscanf(done.out.c_str(), "scene_rev %u", &number), 1) << done.out;
    return number;
}

TemporaryFolder::TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "gonio-e2e-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp");
    folder_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
    std::filesystem::remove_all(folder_);
}

std::string TemporaryFolder::file(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
}

std::string isotropic_ies(double candela) {
    std::ostringstream text;
    text << "IESNA:LM-63-2002\r\n[TEST] e2e\r\n[MANUFAC] none\r\nTILT=NONE\r\n1 -1 1 3 1 1 2 0 0 0\r\n1 1 10\r\n0 90 "
            "180\r\n0\r\n"
         << candela << " " << candela << " " << candela << "\r\n";
    return text.str();
}

std::string floor_gltf(double reflectance) {
    const auto base64 = [](const std::string& bytes) {
        static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        std::string out;
        for (std::size_t i = 0; i < bytes.size(); i += 3) {
            unsigned v = 0;
            for (std::size_t k = 0; k < 3; ++k)
                v = v << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
            for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : digits[v >> (18 - 6 * k) & 63u];
        }
        return out;
    };
    const float positions[] = {-10, 0, 10, 10, 0, 10, 10, 0, -10, -10, 0, -10};
    const std::uint16_t indices[] = {0, 1, 2, 0, 2, 3};
    std::string bytes(reinterpret_cast<const char*>(positions), sizeof positions);
    bytes.append(reinterpret_cast<const char*>(indices), sizeof indices);
    const double s = std::sqrt(0.5);
    nlohmann::json gltf = {
        {"asset", {{"version", "2.0"}}},
        {"extensionsUsed", {"EXT_lights_ies"}},
        {"extensions",
         {{"EXT_lights_ies",
           {{"lights",
             {{{"name", "lamp"}, {"uri", "data:application/x-ies-lm-63;base64," + base64(isotropic_ies(1000))}}}}}}}},
        {"buffers", {{{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}}}},
        {"bufferViews",
         {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", sizeof positions}},
          {{"buffer", 0}, {"byteOffset", sizeof positions}, {"byteLength", sizeof indices}}}},
        {"accessors",
         {{{"bufferView", 0},
           {"componentType", 5126},
           {"count", 4},
           {"type", "VEC3"},
           {"min", {-10, 0, -10}},
           {"max", {10, 0, 10}}},
          {{"bufferView", 1}, {"componentType", 5123}, {"count", 6}, {"type", "SCALAR"}}}},
        {"materials", {{{"pbrMetallicRoughness", {{"baseColorFactor", {reflectance, reflectance, reflectance, 1}}}}}}},
        {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", 0}}}}}}},
        {"cameras", {{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}}}}}},
        {"nodes",
         {{{"mesh", 0}},
          {{"name", "lamp"},
           {"translation", {0, 2, 0}},
           {"rotation", {-s, 0, 0, s}},
           {"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}},
          {{"camera", 0}, {"translation", {0, 6, 0}}, {"rotation", {-s, 0, 0, s}}}}},
        {"scenes", {{{"nodes", {0, 1, 2}}}}},
        {"scene", 0}};
    return gltf.dump();
}

}  // namespace gonio::test
