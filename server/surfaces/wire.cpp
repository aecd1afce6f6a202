#include "server/surfaces/wire.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "protocol/text/text_bytes.h"
#include "server/base/bounded_file.h"

namespace gonio {

std::string surface_identity(std::uint16_t vendor, std::uint16_t product, const std::string& serial,
                             const std::string& port) {
    char id[16];
    std::snprintf(id, sizeof id, "%04x:%04x", vendor, product);
    const bool tells = serial.size() <= 64 && serial.find_first_not_of("0 ") != serial.npos;
    if (tells) return std::string(id) + ":" + shown_text(serial, 64);
    return port.empty() ? id : std::string(id) + "@" + port;
}

std::string small_file(const std::string& path) {
    const auto read = read_bounded_file(path, 4095);
    std::string text = read ? *read : "";
    while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.pop_back();
    return text;
}

// In ".../usb1/1-2/1-2.3/1-2.3:1.0/…" the interface has a colon; what stands before it is the port.
std::string usb_port_of(const std::string& sysfs_path) {
    std::error_code error;
    const std::filesystem::path real = std::filesystem::canonical(sysfs_path, error);
    if (error) return {};
    for (const auto& part : real) {
        const std::string name = part.string();
        const std::size_t colon = name.find(':'), dash = name.find('-');
        if (colon != name.npos && dash != name.npos && dash < colon && name[0] >= '0' && name[0] <= '9')
            return name.substr(0, colon);
    }
    return {};
}

std::vector<std::string> nodes_in(const std::string& folder, const std::string& file) {
    std::vector<std::string> nodes;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        nodes.push_back(entry.path().filename().string() + " " + small_file(entry.path() / file) + " " +
                        std::filesystem::canonical(entry.path(), error).string());
    std::sort(nodes.begin(), nodes.end());
    return nodes;
}

}  // namespace gonio
