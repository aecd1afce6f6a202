#include "server/bake/parts.h"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "server/base/atomic_file.h"

namespace gonio::bake {
namespace {

// A part's file: this, then the values, then the errors, as the machine has floats.
struct Head {
    char magic[8] = {'g', 'o', 'n', 'i', 'o', 'm', 'a', 'p'};
    char key[32] = {};
    std::uint64_t values = 0, errors = 0, rays = 0;
    double seconds = 0.0;
};

std::string path_of(const std::string& folder, const std::string& name) {
    return (std::filesystem::path(folder) / (name + ".part")).string();
}

}  // namespace

std::optional<PartValues> PartStore::load(const std::string& name, const std::string& key, std::size_t values,
                                          std::size_t errors) const {
    if (folder_.empty()) return std::nullopt;
    const std::string path = path_of(folder_, name);
    std::error_code failed;
    const std::size_t wanted = sizeof(Head) + (values + errors) * sizeof(float);
    if (std::filesystem::file_size(path, failed) != wanted || failed) return std::nullopt;
    std::ifstream file(path, std::ios::binary);
    Head head;
    file.read(reinterpret_cast<char*>(&head), sizeof head);
    if (!file || std::memcmp(head.magic, Head{}.magic, sizeof head.magic) != 0 || key.size() != sizeof head.key ||
        std::memcmp(head.key, key.data(), sizeof head.key) != 0 || head.values != values || head.errors != errors)
        return std::nullopt;
    PartValues part;
    part.values.resize(values);
    part.error.resize(errors);
    part.rays = head.rays;
    part.seconds = head.seconds;
    file.read(reinterpret_cast<char*>(part.values.data()), static_cast<std::streamsize>(values * sizeof(float)));
    file.read(reinterpret_cast<char*>(part.error.data()), static_cast<std::streamsize>(errors * sizeof(float)));
    if (!file) return std::nullopt;
    return part;
}

bool PartStore::save(const std::string& name, const std::string& key, const PartValues& part) const {
    if (folder_.empty()) return false;
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    if (failed) return false;
    Head head;
    std::memcpy(head.key, key.data(), std::min(key.size(), sizeof head.key));
    head.values = part.values.size(), head.errors = part.error.size();
    head.rays = part.rays, head.seconds = part.seconds;
    std::string bytes(sizeof head + (part.values.size() + part.error.size()) * sizeof(float), '\0');
    std::memcpy(bytes.data(), &head, sizeof head);
    if (!part.values.empty())
        std::memcpy(bytes.data() + sizeof head, part.values.data(), part.values.size() * sizeof(float));
    if (!part.error.empty())
        std::memcpy(bytes.data() + sizeof head + part.values.size() * sizeof(float), part.error.data(),
                    part.error.size() * sizeof(float));
    return static_cast<bool>(write_file_atomically(path_of(folder_, name), bytes));
}

}  // namespace gonio::bake
