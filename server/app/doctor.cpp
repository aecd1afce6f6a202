#include "server/app/doctor.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <grp.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string_view>

#include <nlohmann/json.hpp>

#include "client/connection/connection.h"
#include "server/app/http_options.h"
#include "server/assets/picture_module.h"
#include "server/base/descriptor.h"
#include "server/gl/context.h"
#include "server/gl/vendor_files.h"
#include "server/inputs/udp_socket.h"
#include "server/stream/encoder.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;
using State = Finding::State;

// Folders that udev reads rules from (udev(7)), and the one below /usr/local.
constexpr std::array kRuleFolders = {"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d",
                                     "/usr/lib/udev/rules.d", "/lib/udev/rules.d"};
constexpr unsigned kOtherDescriptors = 64;  // files, devices, inputs

// Result: the files of a folder whose names begin so, in order.
std::vector<std::string> nodes(const std::string& folder, const std::string& prefix) {
    std::vector<std::string> found;
    std::error_code failed;
    for (auto entry = fs::directory_iterator(folder, failed); !failed && entry != fs::directory_iterator();
         entry.increment(failed))
        if (entry->path().filename().string().starts_with(prefix)) found.push_back(entry->path());
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<std::string> gpu_nodes(const std::string& root) {
    std::vector<std::string> found = nodes(root + "/dev/dri", "renderD");
    for (const std::string& node : nodes(root + "/dev", "nvidia"))
        if (!fs::is_directory(node)) found.push_back(node);
    return found;
}

// Joining root's group would give away more than a device.
std::string mend_of_node(const std::string& node, const Machine& machine) {
    const std::string group = machine.group_of(node);
    if (!group.empty() && group != "root" && machine.group_may_use(node))
        return "usermod -aG " + group + " USER, then log in again";
    return "give the node a group that may read and write it, by a rule of udev: GROUP=\"render\", MODE=\"0660\"";
}

// Result: a finding of each node that this user may not use.
std::vector<Finding> closed_nodes(const std::vector<std::string>& found, const std::string& what,
                                  const Machine& machine) {
    std::vector<Finding> findings;
    for (const std::string& node : found)
        if (!machine.may_use(node))
            findings.push_back({"device", State::warning, what + " " + node + " may not be used by this user.",
                                mend_of_node(node, machine)});
    return findings;
}

struct Address {
    sockaddr_storage storage{};
    socklen_t length = 0;  // 0: the text is no address
    const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

Address address_of(const std::string& host, std::uint16_t port) {
    Address address;
    const std::string numeric = host == "localhost" ? "127.0.0.1" : host;
    auto* const v4 = reinterpret_cast<sockaddr_in*>(&address.storage);
    auto* const v6 = reinterpret_cast<sockaddr_in6*>(&address.storage);
    if (::inet_pton(AF_INET, numeric.c_str(), &v4->sin_addr) == 1) {
        v4->sin_family = AF_INET;
        v4->sin_port = htons(port);
        address.length = sizeof *v4;
    } else if (::inet_pton(AF_INET6, numeric.c_str(), &v6->sin6_addr) == 1) {
        v6->sin6_family = AF_INET6;
        v6->sin6_port = htons(port);
        address.length = sizeof *v6;
    }
    return address;
}

// Result: why it cannot be listened on, an errno; 0: it can.
int try_listening(const Address& address) {
    if (address.length == 0) return EINVAL;
    const Descriptor socket(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (!socket) return errno;
    set_option(socket, SOL_SOCKET, SO_REUSEADDR, 1);
    if (::bind(socket.fd(), address.get(), address.length) != 0) return errno;
    return ::listen(socket.fd(), 1) == 0 ? 0 : errno;
}

// Whether what listens there answers /healthz as goniod does, over TLS as its port answers plain HTTP.
bool goniod_answers(const Address& address) {
    const Descriptor socket(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (!socket) return false;
    const timeval most{1, 0};
    ::setsockopt(socket.fd(), SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
    ::setsockopt(socket.fd(), SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    constexpr std::string_view kRequest = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    if (::connect(socket.fd(), address.get(), address.length) != 0 ||
        ::send(socket.fd(), kRequest.data(), kRequest.size(), MSG_NOSIGNAL) != std::ssize(kRequest))
        return false;
    std::string answer;
    char part[512];
    while (answer.size() < std::size_t{4096}) {
        const ssize_t count = ::recv(socket.fd(), part, sizeof part, 0);
        if (count <= 0) break;
        answer.append(part, static_cast<std::size_t>(count));
    }
    return answer.ends_with("\r\n\r\nok\n") || answer.ends_with("\r\n\r\nThis port speaks HTTPS, not plain HTTP.\n");
}

std::string mend_of_port(int error) {
    switch (error) {
        case EADDRINUSE:
            return "end what listens there (ss -ltnp names it), or give --listen another port";
        case EACCES:
            return "give --listen a port from 1024, or the unit CAP_NET_BIND_SERVICE both as AmbientCapabilities= and "
                   "as CapabilityBoundingSet=";
        case EADDRNOTAVAIL:
            return "give --listen an address of this machine (ip address lists them), or 0.0.0.0 for all";
        default:
            return "give --listen another address";
    }
}

// opened: just now. beside: a goniod listens at --listen, whose consoles these may be.
Finding check_input(const char* protocol, const UdpPeer& at, const Result<Descriptor>& opened, bool beside) {
    const int error = errno;
    const std::string name = std::string(protocol) + " port " + std::to_string(at.port);
    if (opened) return {"port", State::ok, name + " can be listened on.", ""};
    if (beside && error == EADDRINUSE)
        return {"port", State::warning, name + ": something listens there already, as a goniod does at --listen.",
                "none, if it is that goniod (ss -lntup names it)"};
    return {"port", State::fault, name + ": " + opened.error().text(),
            error == EADDRNOTAVAIL ? "give the option an address of this machine (ip address lists them)"
            : error == EACCES      ? "give the option a port from 1024"
                                   : "end what listens there (ss -lntup names it), or give the option another port"};
}

// libepoxy opens these when they are first used, and aborts where they are missing. Result: those that are.
std::string missing_libraries() {
    const auto opens = [](const char* name) { return ::dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr; };
    std::string missing = opens("libEGL.so.1") ? "" : "libEGL.so.1";
    if (!opens("libOpenGL.so.0") && !opens("libGL.so.1"))
        missing += (missing.empty() ? "" : " and ") + std::string("libOpenGL.so.0");
    return missing;
}

// Of a driver's file without its library; and where nothing renders for that reason.
const std::string kMendVendorLibrary =
    "install the library that the file names (NVIDIA: libnvidia-gl, or run the container with the NVIDIA runtime and "
    "NVIDIA_DRIVER_CAPABILITIES=all)";
const std::string kMendVendor =
    kMendVendorLibrary + "; or remove the file or unset __EGL_VENDOR_LIBRARY_FILENAMES, so that Mesa renders";

// The GL, and what it runs on.
std::vector<Finding> check_graphics(const Options& options, const Machine& machine) {
    if (options.renderer == "null") return {{"egl", State::ok, "No GL is asked for (--renderer null).", ""}};
    if (const std::string missing = missing_libraries(); !missing.empty())
        return {
            {"egl", State::fault, missing + " cannot be opened.", "apt-get install libegl1 libopengl0 libegl-mesa0"}};
    std::unique_ptr<gl::Context> context;
    try {
        context = gl::Context::create({options.device, false});
    } catch (const std::runtime_error& error) {
        if (options.device >= 0)
            return {{"egl", State::fault, error.what(),
                     "give --device the index of one that works, or leave it out: then goniod looks for one"}};
        if (!gl::dead_vendor_files().empty()) return {{"egl", State::fault, error.what(), kMendVendor}};
        return {{"egl", State::fault, error.what(),
                 "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri; for a GPU its maker's driver with EGL"}};
    }
    std::vector<Finding> findings{{"egl", State::ok, context->description(), ""}};
    const auto gpus = gpu_nodes(machine.root);
    if (!context->software())
        findings.push_back({"gpu", State::ok, "The GPU renders: " + context->renderer() + ".", ""});
    else if (gpus.empty())
        findings.push_back({"gpu", State::ok, "There is no GPU: the CPU renders (" + context->renderer() + ").", ""});
    else if (const std::string dead = gl::dead_vendor_files(); !dead.empty())
        findings.push_back({"gpu", State::warning, "There is " + gpus.front() + ", but the CPU renders: " + dead + ".",
                            kMendVendorLibrary});
    else
        findings.push_back({"gpu", State::warning, "There is " + gpus.front() + ", but the CPU renders.",
                            "install the GPU's driver with EGL (Mesa: libgl1-mesa-dri; NVIDIA: nvidia-driver), and see "
                            "to the rights on its nodes"});
    return findings;
}

Finding check_encoder(const Options& options) {
    std::string why;
    const auto kinds = working_encoders(
        options.encoder, options.width_px, options.height_px,
        [](const std::string& kind, int width, int height) { return H264Encoder::open(width, height, kind); },
        [&](const std::string& line) { why += (why.empty() ? "" : "; ") + line; });
    if (!kinds.empty()) return {"encoder", State::ok, kinds.front() + " encodes H.264.", ""};
    if (options.encoder == "mjpeg") return {"encoder", State::ok, "No H.264 is asked for (--encoder mjpeg).", ""};
    const bool named = options.encoder != "auto";
    return {"encoder", named ? State::fault : State::warning, "There is no H.264: " + why,
            named ? "give --encoder auto, or install the driver of this encoder"
                  : "give a libavcodec that has libx264, as Debian's libavcodec59 does; until then pictures are JPEGs"};
}

// Textures, captures and sequences go through a library that is opened when it is needed.
Finding check_pictures() {
    const auto png = encode_png({1, 1, {0, 0, 0}});
    if (png) return {"pictures", State::ok, "Textures and captures are read and written.", ""};
    return {"pictures", State::warning, "Textures and captures cannot be read or written: " + png.error().text(),
            std::string("put ") + kPictureModuleFile + " beside goniod, or into lib/gonio of where it is installed"};
}

const char* name_of(State state) {
    return state == State::ok ? "ok" : state == State::warning ? "warning" : "fault";
}

}  // namespace

Machine Machine::real() {
    Machine machine;
    machine.may_use = [](const std::string& path) { return ::access(path.c_str(), R_OK | W_OK) == 0; };
    machine.group_of = [](const std::string& path) {
        struct stat status {};
        if (::stat(path.c_str(), &status) != 0) return std::string();
        const struct group* const row = ::getgrgid(status.st_gid);
        return row != nullptr ? std::string(row->gr_name) : std::string();
    };
    machine.group_may_use = [](const std::string& path) {
        struct stat status {};
        constexpr mode_t kBoth = S_IRGRP | S_IWGRP;
        return ::stat(path.c_str(), &status) == 0 && (status.st_mode & kBoth) == kBoth;
    };
    machine.clock_state = [] {
        timex asked{};  // modes 0: it only reads
        return ::adjtimex(&asked);
    };
    machine.receive_bytes = [] {
        const auto socket = open_udp({INADDR_LOOPBACK, 0});
        int doubled = 0;  // the kernel counts its own needs too (socket(7))
        socklen_t size = sizeof doubled;
        if (socket) ::getsockopt(socket->fd(), SOL_SOCKET, SO_RCVBUF, &doubled, &size);
        return static_cast<long long>(doubled) / 2;
    };
    return machine;
}

std::vector<Finding> check_options(const Options& options) {
    std::vector<Finding> findings;
    for (const std::string& fault : options.faults)
        findings.push_back(
            {"options", State::fault, fault + ".",
             fault.find("token-file") != std::string::npos
                 ? "give --token-file; the service's is a credential: as root, GONIOD_TOKEN_FILE=/etc/goniod/token"
             : fault.find("upload-dir") != std::string::npos ? "give --upload-dir a folder that this user may write; "
                                                               "the service's first start makes /var/lib/goniod"
                                                             : "mend the option, or the line of the file"});
    if (findings.empty()) findings.push_back({"options", State::ok, "The options are right.", ""});
    return findings;
}

std::vector<Finding> check_ports(const Options& options) {
    std::vector<Finding> findings;
    const std::string at = options.host + " port " + std::to_string(options.port);
    const Address address = address_of(options.host, options.port);
    const int error = try_listening(address);
    const bool beside = error == EADDRINUSE && goniod_answers(address);
    if (beside)
        findings.push_back({"port", State::warning, at + ": a goniod listens there already.",
                            "none, if it is the one that you mean; else give --listen another port"});
    else if (error != 0)
        findings.push_back({"port", State::fault, at + ": " + std::strerror(error) + ".", mend_of_port(error)});
    else
        findings.push_back({"port", State::ok, at + " can be listened on.", ""});
    const InputOptions& inputs = options.inputs;
    const auto check = [&](const char* protocol, const UdpPeer& peer, const auto& open) {
        findings.push_back(check_input(protocol, peer, open(peer), beside));
    };
    if (inputs.sacn) check("sACN", *inputs.sacn, open_udp);
    if (inputs.artnet) check("Art-Net", *inputs.artnet, open_udp);
    if (inputs.osc) {
        check("OSC (UDP)", *inputs.osc, open_udp);
        check("OSC (TCP)", *inputs.osc, open_tcp);
    }
    return findings;
}

std::vector<Finding> check_devices(const Options& options, const Machine& machine) {
    std::vector<Finding> findings = closed_nodes(gpu_nodes(machine.root), "The GPU's node", machine);
    if (options.surfaces) {
        std::vector<std::string> boxes = nodes(machine.root + "/dev", "hidraw");
        for (const std::string& bus : nodes(machine.root + "/dev/bus/usb", ""))
            for (const std::string& node : nodes(bus, "")) boxes.push_back(node);
        const bool any = !boxes.empty();
        // Keyboards and the rest stay closed, and that is well: a box is what the rules gave to their group.
        std::erase_if(boxes, [&](const std::string& node) { return machine.group_of(node) != "gonio"; });
        for (Finding& finding : closed_nodes(boxes, "The fader box", machine)) findings.push_back(std::move(finding));
        const bool rules = std::ranges::any_of(
            kRuleFolders, [&](const char* folder) { return fs::exists(machine.root + folder + "/70-gonio.rules"); });
        if (any && !rules)
            findings.push_back({"device", State::warning, "udev has no rules for fader boxes: 70-gonio.rules.",
                                "install the package, or packaging/70-gonio.rules into /etc/udev/rules.d; then "
                                "udevadm control --reload && udevadm trigger"});
    }
    if (findings.empty()) findings.push_back({"device", State::ok, "All devices may be used that are there.", ""});
    return findings;
}

Finding check_time(const Machine& machine) {
    if (machine.clock_state() != TIME_ERROR) return {"time", State::ok, "The clock is kept right.", ""};
    return {"time", State::warning,
            "Nothing keeps the clock right: times of the log and of other machines do not agree.",
            "apt-get install systemd-timesyncd && timedatectl set-ntp true (in a container: on its host)"};
}

Finding check_buffers(const Options& options, const Machine& machine) {
    if (!options.inputs.any())
        return {"buffer", State::ok, "No console is listened to: the usual buffers are enough.", ""};
    const long long most = machine.receive_bytes();
    const std::string wanted = std::to_string(kReceiveBytes);
    if (most >= kReceiveBytes) return {"buffer", State::ok, "Sockets may hold " + wanted + " bytes.", ""};
    return {"buffer", State::warning,
            "Sockets hold " + std::to_string(most) + " bytes: what consoles send beyond that at once is lost.",
            "sysctl -w net.core.rmem_max=" + wanted + ", and the same line in /etc/sysctl.d/60-gonio.conf"};
}

Finding check_descriptors(const Options& options, unsigned long long may_open) {
    const unsigned long long needed = options.limits.connections + kOtherDescriptors;
    const std::string has = "The process may open " + std::to_string(may_open) + " files";
    if (may_open >= needed) return {"descriptors", State::ok, has + ".", ""};
    return {"descriptors", State::warning, has + ", fewer than --max-connections needs.",
            "ulimit -n " + std::to_string(needed) + ", or LimitNOFILE= of the unit"};
}

Finding check_leader(const Options& options) {
    auto leader = parse_server_url(options.follow);
    const auto token = token_of_file(options.follow_token_file, nullptr, "--follow-token-file");
    if (!leader || !token)
        return {"leader", State::fault, (leader ? token.error() : leader.error()).text(), "mend the options"};
    leader->ca_file = options.follow_ca;
    const auto opened = Connection::open(*leader, {*token, false, false, "viewer", "goniod --doctor"});
    if (opened) return {"leader", State::ok, options.follow + " can be followed.", ""};
    const Error& why = opened.error();
    return {"leader", State::warning, options.follow + ": " + why.text(),
            why.code == "unreachable" ? "start that goniod, or give --follow its scheme, address and port"
            : why.code == "untrusted" ? "give --follow-ca its authority, and --follow the name of its certificate"
            : why.where == "HTTP 403" ? "give that goniod --host-name " + leader->host
                                      : "give --follow-token-file its token"};
}

std::string findings_text(const std::vector<Finding>& findings, bool json) {
    std::string text;
    for (const Finding& finding : findings) {
        if (json) {
            const nlohmann::ordered_json row{{"check", finding.check},
                                             {"state", name_of(finding.state)},
                                             {"found", finding.found},
                                             {"mend", finding.mend}};
            text += row.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
            continue;
        }
        std::string state = name_of(finding.state), check = finding.check;
        state.resize(9, ' ');
        check.resize(13, ' ');
        text += state + check + finding.found + "\n";
        if (!finding.mend.empty())
            text += std::string(state.size() + check.size(), ' ') + "mend: " + finding.mend + "\n";
    }
    return text;
}

int run_doctor(const Options& options) {
    const Machine machine = Machine::real();
    std::vector<Finding> findings = check_options(options);
    const auto add = [&](std::vector<Finding> more) { std::ranges::move(more, std::back_inserter(findings)); };
    add(check_graphics(options, machine));
    add({check_encoder(options), check_pictures()});
    add(check_ports(options));
    add(check_devices(options, machine));
    rlimit descriptors{};
    ::getrlimit(RLIMIT_NOFILE, &descriptors);
    add({check_time(machine), check_buffers(options, machine), check_descriptors(options, descriptors.rlim_cur)});
    if (!options.follow.empty() && options.faults.empty()) add({check_leader(options)});
    std::cout << findings_text(findings, options.log == "json") << std::flush;
    return std::ranges::any_of(findings, [](const Finding& finding) { return finding.state == State::fault; }) ? 1 : 0;
}

}  // namespace gonio
