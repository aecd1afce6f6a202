// Photometric files that the beams of a fixture type name, as the profiles of their lights.
#include "protocol/text/shortened_text.h"
#include "server/assets/gltf_import.h"
#include "server/exchange/import_parts.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"

namespace gonio::exchange {
namespace {

// Of one fixture type.
std::string photometric_key(const gdtf::FixtureType& type, const std::string& entry) {
    return "photometric " + std::to_string(reinterpret_cast<std::uintptr_t>(&type)) + " " + entry;
}

std::set<std::string> photometric_entries(const gdtf::FixtureType& type) {
    std::set<std::string> entries;
    for (const gdtf::Mode& mode : type.modes)
        for (const gdtf::Geometry& geometry : mode.geometries)
            if (geometry.beam && !geometry.beam->photometric.empty()) entries.insert(geometry.beam->photometric);
    return entries;
}

}  // namespace

void read_photometric(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type) {
    for (const std::string& entry : photometric_entries(type)) {
        const auto bytes = archive.read(entry);
        auto made = bytes ? make_profile(shortened_text(type.name + " " + entry, kMaxNameBytes), *bytes)
                          : Result<std::shared_ptr<const Profile>>(bytes.error());
        if (made)
            if (auto full = take_memory(import.room, kBytesOfProfile + kBytesPerFileByte * bytes->size(), 1, entry))
                made = *full;
        if (!made) {
            import.report.add(
                Outcome::left_out,
                "a beam's photometric file cannot be read: its flux and angles count: " + made.error().code,
                named(type.name + ": " + entry, made.error()));
            continue;
        }
        import.report.add(Outcome::taken, "photometric file of a beam", type.name + ": " + entry);
        tables_of(**made);
        import.profiles[photometric_key(type, entry)] = *made;
    }
}

std::shared_ptr<const Profile> photometric_profile(const ShowImport& import, const gdtf::FixtureType& type,
                                                   const gdtf::Beam& beam) {
    if (beam.photometric.empty()) return nullptr;
    const auto found = import.profiles.find(photometric_key(type, beam.photometric));
    return found == import.profiles.end() ? nullptr : found->second;
}

}  // namespace gonio::exchange
