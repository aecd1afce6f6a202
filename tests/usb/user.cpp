#include "tests/usb/user.h"

#include <grp.h>
#include <libusb.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "protocol/schema/surface.pb.h"
#include "server/surfaces/control_surfaces.h"

namespace gonio::test {
namespace {

// Shared with the processes of all users: whether libusb refuses what goes to a box.
std::atomic<bool>& output_fails() {
    static auto* const shared =
        new (::mmap(nullptr, sizeof(std::atomic<bool>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
            std::atomic<bool>(false);
    return *shared;
}

constexpr uid_t kUser = 1000;
constexpr gid_t kGroup = 990;  // gonio, as in the guest's /etc/group

// Tells the table and the latest updates as lines, and takes "show IDENTITY VALUE CONTROL".
[[noreturn]] void serve(int socket, bool alsa) {
    if (setgroups(0, nullptr) != 0 || setgid(kGroup) != 0 || setuid(kUser) != 0) std::_Exit(3);
    SurfaceOptions options;
    if (alsa) options.midi = SurfaceOptions::Midi::alsa;
    auto surfaces = ControlSurfaces::start(options, [] {});
    if (!surfaces) std::_Exit(4);
    SurfaceTargets wants;
    std::string input;
    for (;;) {
        std::ostringstream lines;
        lines.precision(12);
        if (auto table = (*surfaces)->table().try_take())
            for (const v1::SurfaceDevice& row : table->table.devices())
                lines << "device " << row.device() << " " << row.transport() << " " << row.state() << " " << row.error()
                      << "\n";
        if (auto updates = (*surfaces)->updates().try_take())
            for (const auto& [key, heard] : updates->controls)
                lines << "moved "
                      << (heard.input.kind == ControlKind::relative ? heard.input.clicks : heard.input.value) << " "
                      << (heard.input.kind == ControlKind::relative ? 1 : 0) << " " << key.second << "\n";
        const std::string text = lines.str();
        if (!text.empty() && ::write(socket, text.data(), text.size()) < 0) std::_Exit(0);
        pollfd state{socket, POLLIN, 0};
        if (::poll(&state, 1, 5) <= 0) continue;
        char bytes[512];
        const ssize_t count = ::read(socket, bytes, sizeof bytes);
        if (count <= 0) std::_Exit(0);
        input.append(bytes, static_cast<std::size_t>(count));
        for (std::size_t end = 0; (end = input.find('\n')) != input.npos; input.erase(0, end + 1)) {
            std::istringstream line(input.substr(0, end));
            std::string verb, identity, control;
            double value = 0;
            line >> verb >> identity >> value;
            std::getline(line >> std::ws, control);
            wants[identity][control] = value;
            (*surfaces)->show(wants);
        }
    }
}

}  // namespace

// Linked in the place of libusb's own (--wrap), whose names the linker makes.
// NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {
int __real_libusb_submit_transfer(libusb_transfer* transfer);
int __wrap_libusb_submit_transfer(libusb_transfer* transfer) {
    const bool out = (transfer->endpoint & LIBUSB_ENDPOINT_IN) == 0;
    return out && output_fails() ? LIBUSB_ERROR_IO : __real_libusb_submit_transfer(transfer);
}
}
// NOLINTEND(bugprone-reserved-identifier)

User::User(bool alsa) {
    output_fails() = false;
    int sockets[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, sockets) != 0) std::abort();
    pid_ = fork();
    if (pid_ == 0) {
        ::close(sockets[0]);
        serve(sockets[1], alsa);
    }
    ::close(sockets[1]);
    socket_ = sockets[0];
}

User::~User() {
    ::close(socket_);
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
}

bool User::read_lines(int timeout_ms) {
    pollfd state{socket_, POLLIN, 0};
    if (::poll(&state, 1, timeout_ms) <= 0) return false;
    char bytes[4096];
    const ssize_t count = ::read(socket_, bytes, sizeof bytes);
    if (count <= 0) return false;
    buffer_.append(bytes, static_cast<std::size_t>(count));
    for (std::size_t end = 0; (end = buffer_.find('\n')) != buffer_.npos; buffer_.erase(0, end + 1)) {
        std::istringstream line(buffer_.substr(0, end));
        std::string kind, identity, transport, rest;
        line >> kind;
        if (kind == "device") {
            line >> identity >> transport;
            std::getline(line >> std::ws, rest);
            devices_[identity + " " + transport] = rest;
        } else {
            double value = 0;
            int relative = 0;
            line >> value >> relative;
            std::getline(line >> std::ws, rest);
            values_[rest] = relative != 0 ? values_[rest] + value : value;
            ++moved_;
        }
    }
    return true;
}

bool User::device_is(const std::string& identity, const std::string& transport, const std::string& state,
                     int timeout_ms) {
    for (int waited = 0; waited <= timeout_ms; waited += 20) {
        const auto row = devices_.find(identity + " " + transport);
        if (row != devices_.end() && row->second.starts_with(state)) return true;
        read_lines(20);
    }
    return false;
}

std::string User::error(const std::string& identity, const std::string& transport) const {
    const auto row = devices_.find(identity + " " + transport);
    if (row == devices_.end()) return "no such device";
    const std::size_t space = row->second.find(' ');
    return space == std::string::npos ? "" : row->second.substr(space + 1);
}

bool User::heard(const std::string& control, double value) {
    for (int waited = 0; waited <= 3000; waited += 20) {
        const auto at = values_.find(control);
        if (at != values_.end() && std::abs(at->second - value) < 1e-9) {
            values_.erase(at);
            return true;
        }
        read_lines(20);
    }
    return false;
}

void User::pause() const {
    kill(pid_, SIGSTOP);
}

void User::resume() const {
    kill(pid_, SIGCONT);
}

void User::fail_output(bool fails) const {
    output_fails() = fails;
}

double User::last(const std::string& control) const {
    const auto at = values_.find(control);
    return at == values_.end() ? std::nan("") : at->second;
}

void User::show(const std::string& identity, const std::string& control, double value) {
    const std::string line = "show " + identity + " " + std::to_string(value) + " " + control + "\n";
    if (::write(socket_, line.data(), line.size()) < 0) std::perror("show");
}

void User::listen(int ms) {
    for (int waited = 0; waited < ms; waited += 20) read_lines(20);
}

}  // namespace gonio::test
