#include "server/surfaces/surface_profiles.h"

#include <filesystem>

#include "cmake/embedded_file.h"
#include "protocol/surface/qxi.h"
#include "protocol/surface/surface_toml.h"
#include "server/base/bounded_file.h"

namespace gonio {

std::span<const EmbeddedFile> shipped_profiles();  // profiles/*.toml; embed_files() makes it

namespace {

constexpr const char* kQlcFolder = "/usr/share/qlcplus/inputprofiles";  // Debian's qlcplus-data

Result<SurfaceProfile> read_file(const std::filesystem::path& path) {
    const auto text = read_bounded_file(path.string(), kMaxSurfaceFileBytes);
    if (!text) return Error{"not_found", path.string(), "", "the profile " + text.error().message};
    auto profile = path.extension() == ".qxi" ? read_qxi(*text) : read_surface_profile(*text);
    if (profile) return profile;
    Error error = profile.error();
    error.where = path.string() + " " + error.where;
    return error;
}

std::string lower(std::string text) {
    for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return text;
}

}  // namespace

Result<SurfaceProfiles> SurfaceProfiles::load(const std::map<std::string, std::string>& given) {
    SurfaceProfiles profiles;
    for (const EmbeddedFile& file : shipped_profiles()) {
        const auto profile = read_surface_profile(file.content);
        if (!profile)
            return Error{profile.error().code, std::string(file.name) + " " + profile.error().where,
                         profile.error().value, profile.error().message};
        for (const std::string& id : profile->usb) profiles.by_id_[id] = *profile;
    }
    for (const auto& [id, path] : given) {
        auto profile = read_file(path);
        if (!profile) return profile.error();
        profiles.by_id_[id] = std::move(*profile);
    }
    return profiles;
}

SurfaceProfile SurfaceProfiles::find(const std::string& id, const std::string& product) const {
    if (const auto found = by_id_.find(id); found != by_id_.end()) return found->second;
    // "Manufacturer Model" or the model alone, as the surface says it.
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(kQlcFolder, error)) {
        if (entry.path().extension() != ".qxi" || product.size() < 4) continue;
        const std::string stem = lower(entry.path().stem().string()), name = lower(product);
        const std::size_t dash = stem.find('-');
        std::string model = dash == stem.npos ? stem : stem.substr(dash + 1), asked;
        for (const char c : name) asked += c == ' ' || c == '-' ? "" : std::string(1, c);
        std::erase(model, '-');
        if (model != asked && stem.substr(0, dash) + model != asked) continue;
        if (auto profile = read_file(entry.path())) return *profile;
    }
    return {};
}

std::vector<std::string> SurfaceProfiles::ids() const {
    std::vector<std::string> ids;
    for (const auto& [id, profile] : by_id_) ids.push_back(id);
    return ids;
}

}  // namespace gonio
