// What the texts of options must be. The validators are for CLI11's check(), so that a value that is refused is named
// with the line it came from. Only for .cpp files, because it brings CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "ies/core/result.h"
#include "server/inputs/udp_socket.h"

namespace gonio {

struct ListenPlace {
    std::string host;  // localhost, or an address, IPv6 without brackets
    std::uint16_t port = 0;
};
struct PictureSize {
    int width_px = 0, height_px = 0;  // even, 16..4096
};

// Errors of all three: "invalid_argument", with the text as value.
Result<ListenPlace> read_listen(const std::string& text);  // HOST:PORT
Result<PictureSize> read_size(const std::string& text);    // WIDTHxHEIGHT
// Result: nothing where the text is empty or "off".
Result<std::optional<UdpPeer>> read_udp_place(const std::string& text, std::uint16_t default_port);

CLI::Validator listen_place();
CLI::Validator picture_size();
CLI::Validator udp_place();
// A finite number, low..high: CLI::Range lets NaN pass, which is neither below nor above.
CLI::Validator finite_in(double low, double high);
CLI::Validator fader_box();      // VVVV:PPPP or VVVV:PPPP=FILE
CLI::Validator readable_file();  // or empty: none; its content is not read
CLI::Validator scene_name();     // cornell, atrium or a readable file
// Empty, a folder that can be read and written, or a path where one can be made.
CLI::Validator upload_folder();
CLI::Validator host_name();    // a name or an address: no scheme, port or wildcard
CLI::Validator page_origin();  // http(s)://host[:port]

}  // namespace gonio
