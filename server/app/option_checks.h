// What the texts of options must be, for CLI11's check(), so that a value that is refused is named with the line it
// came from. Only for .cpp files, because it brings CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "ies/core/result.h"
#include "server/inputs/udp_socket.h"

namespace gonio {

struct ListenAddress {
    std::string host;  // localhost, or an address, IPv6 without brackets
    std::uint16_t port = 0;
};
struct PictureSize {
    int width_px = 0, height_px = 0;  // even, 16..4096
};

// Errors of all three: "invalid_argument", with the text as value.
Result<ListenAddress> read_listen(const std::string& text);  // HOST:PORT
Result<PictureSize> read_size(const std::string& text);      // WIDTHxHEIGHT
// Result: nothing where the text is empty or "off".
Result<std::optional<UdpPeer>> read_udp_address(const std::string& text, std::uint16_t default_port);

// For check() of an option. Results: what is wrong with the text, a sentence; nothing where all is well.
std::string check_listen(const std::string& text);
std::string check_size(const std::string& text);
std::string check_udp_address(const std::string& text);
std::string check_box(const std::string& text);          // VVVV:PPPP or VVVV:PPPP=FILE
std::string check_file_if_any(const std::string& path);  // its content is not read
std::string check_scene(const std::string& name);        // cornell, atrium or a readable file
std::string check_upload_folder(
    const std::string& path);                          // empty, one for reading and writing, or one that can be made
std::string check_host_name(const std::string& text);  // a name or an address: no scheme, port or wildcard
std::string check_origin(const std::string& text);     // http(s)://host[:port]
std::string check_shard(const std::string& text);      // i/n, 0 <= i < n <= 10000
std::string check_decimal(const std::string& text);    // not 0x10, which CLI11 would read as 16
// A finite number, low..high: CLI::Range lets NaN pass, which is neither below nor above.
CLI::Validator finite_in(double low, double high);

}  // namespace gonio
