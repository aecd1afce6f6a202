#include "server/app/option_checks.h"

#include <arpa/inet.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "ies/core/number_text.h"
#include "protocol/schema/words.h"
#include "server/assets/assets.h"
#include "server/scene/limits.h"
#include "server/sequence/sequence.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr int kMinSide = 16, kMaxSide = 4096;                    // pixels; SetSize has the same
constexpr std::size_t kMaxNameBytes = 253, kMaxLabelBytes = 63;  // RFC 1035, 2.3.4

bool is_alphanumeric(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool is_address(int family, const std::string& text) {
    in6_addr address{};  // the longest
    return inet_pton(family, text.c_str(), &address) == 1;
}

// Labels of letters, digits, '-' and '_', also an IPv4 address; a dot at the end is the root's.
bool is_dns_name(std::string_view text) {
    if (text.ends_with('.')) text.remove_suffix(1);
    if (text.empty() || text.size() > kMaxNameBytes) return false;
    for (std::size_t at = 0; at <= text.size();) {
        const std::string_view label = text.substr(at, text.find('.', at) - at);
        if (label.empty() || label.size() > kMaxLabelBytes || label.front() == '-' || label.back() == '-') return false;
        for (const char c : label)
            if (!is_alphanumeric(c) && c != '-' && c != '_') return false;
        at += label.size() + 1;
    }
    return true;
}

std::string quoted(const std::string& text) {
    return "'" + text + "'";
}

// Nothing is opened: that is the start's to do. Only regular files are read (server/base/bounded_file.h).
std::string check_file(const std::string& path) {
    std::error_code failed;
    if (fs::is_directory(path, failed)) return quoted(path) + " is a folder, not a file";
    if (access(path.c_str(), R_OK) != 0) return "cannot read the file " + quoted(path);
    return fs::is_regular_file(path, failed) ? "" : quoted(path) + " is no regular file";
}

template <typename Read>
std::string check_read(const Read& read) {
    return read ? "" : read.error().message + ", not " + quoted(read.error().value);
}

}  // namespace

std::string check_host_name(const std::string& text) {
    if (is_address(AF_INET6, text) || is_dns_name(text)) return "";
    return "must be a name or an address without scheme, port, brackets or wildcard, not " + quoted(text);
}

std::string check_origin(const std::string& text) {
    std::string wrong = "must be http://HOST[:PORT] or https://HOST[:PORT], not " + quoted(text);
    const std::string lower = CLI::detail::to_lower(text);  // as origins are compared
    const std::size_t scheme = lower.starts_with("https://") ? 8 : lower.starts_with("http://") ? 7 : 0;
    if (scheme == 0) return wrong;
    std::string host = text.substr(scheme);
    if (host.ends_with('/')) {
        const std::string without = text.substr(0, text.size() - 1);
        return check_origin(without).empty() ? "must be " + quoted(without) + " without the slash at its end" : wrong;
    }
    const std::size_t bracket = host.starts_with('[') ? host.find(']') : 0;
    if (bracket == std::string::npos) return wrong;
    const std::size_t colon = host.find(':', bracket);
    if (colon != std::string::npos) {
        const auto port = parse_count(std::string_view(host).substr(colon + 1));
        if (!port || *port < 1 || *port > 65535) return wrong;
        host.resize(colon);
    }
    if (bracket == 0) return is_dns_name(host) ? "" : wrong;
    return bracket + 1 == host.size() && is_address(AF_INET6, host.substr(1, bracket - 1)) ? "" : wrong;
}

std::string check_box(const std::string& box) {
    const auto hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); };
    bool good = box.size() == 9 || (box.size() > 10 && box[9] == '=');
    for (std::size_t i = 0; good && i < 9; ++i) good = i == 4 ? box[i] == ':' : hex(box[i]);
    return good ? "" : "must be VVVV:PPPP or VVVV:PPPP=FILE, not " + quoted(box);
}

std::string check_file_if_any(const std::string& path) {
    return path.empty() ? "" : check_file(path);
}

std::string check_scene(const std::string& name) {
    return is_built_in(name) ? "" : check_file(name);
}

std::string check_upload_folder(const std::string& folder) {
    if (folder.empty()) return "";
    std::error_code failed;
    fs::path there = fs::absolute(folder, failed).lexically_normal();
    const auto missing = [&] { return fs::status(there, failed).type() == fs::file_type::not_found; };
    const bool made = missing();
    while (missing() && there.has_relative_path()) there = there.parent_path();
    if (fs::is_directory(there, failed) && access(there.c_str(), (made ? 0 : R_OK) | W_OK | X_OK) == 0) return "";
    return quoted(folder) + (made ? " cannot be made" : " cannot be written as a folder") + " of files";
}

Result<ListenAddress> read_listen(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos || colon == 0) return Error{"invalid_argument", "", text, "must be HOST:PORT"};
    ListenAddress address{text.substr(0, colon), 0};
    const bool brackets = address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
    if (brackets) address.host = address.host.substr(1, address.host.size() - 2);
    const std::string unscoped = address.host.substr(0, address.host.find('%'));  // fe80::1%eth0
    if (address.host != "localhost" && !is_address(AF_INET, address.host) && !is_address(AF_INET6, unscoped))
        return Error{"invalid_argument", "", text, "the host must be localhost or a numeric address"};
    const auto port = parse_count(std::string_view(text).substr(colon + 1));
    if (!port || *port > 65535) return Error{"invalid_argument", "", text, "the port must be 0..65535"};
    address.port = static_cast<std::uint16_t>(*port);
    return address;
}

Result<PictureSize> read_size(const std::string& text) {
    const auto size = parse_size(text);
    if (!size) return Error{"invalid_argument", "", text, "must be WIDTHxHEIGHT"};
    for (const unsigned side : {size->first, size->second})
        if (side < kMinSide || side > kMaxSide || side % 2 != 0)
            return Error{"invalid_argument", "", text, "width and height must be even, 16..4096"};
    return PictureSize{static_cast<int>(size->first), static_cast<int>(size->second)};
}

Result<std::optional<UdpPeer>> read_udp_address(const std::string& text, std::uint16_t default_port) {
    if (text.empty() || text == "off") return std::optional<UdpPeer>();
    const auto peer = parse_peer(text, default_port);
    if (!peer) return peer.error();
    return std::optional<UdpPeer>(*peer);
}

std::string check_listen(const std::string& text) {
    return check_read(read_listen(text));
}

std::string check_size(const std::string& text) {
    return check_read(read_size(text));
}

std::string check_udp_address(const std::string& text) {
    return check_read(read_udp_address(text, 1));
}

std::string check_shard(const std::string& text) {
    return sequence::parse_shard(text) ? "" : "must be i/n with 0 <= i < n <= 10000, not " + quoted(text);
}

std::string check_decimal(const std::string& text) {
    const bool good = text.find_first_of("xX") == std::string::npos;
    return good ? "" : "must be a decimal number, not " + quoted(text);
}

CLI::Validator finite_in(double low, double high) {
    const std::string range = number_text(low) + " - " + number_text(high);
    return {[=](std::string& text) {
                double value = 0;
                const bool good = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
                return good && value >= low && value <= high ? "" : "Value " + text + " not in range " + range;
            },
            "FLOAT in [" + range + "]"};
}

}  // namespace gonio
