#include "server/scene/packed_gobo.h"

namespace gonio {

std::span<const std::uint16_t> transmission_of(const Gobo& gobo) {
    if (!gobo.packed) return gobo.transmission;
    const PackedGobo& packed = *gobo.packed;
    std::call_once(packed.once, [&] {
        const auto size = static_cast<std::size_t>(gobo.size_px);
        auto decoded = packed.decode(packed.bytes, packed.place);
        if (decoded && decoded->size() == size * size)
            packed.made = std::move(*decoded);
        else
            packed.failed = decoded ? "it is of another size than its header says" : decoded.error().text();
    });
    return packed.made;
}

std::string untold_failure(const Light& light) {
    const int number = light.shaped_of.second.gobo;
    const Gobos* const gobos = light.profile ? light.profile->gobos.get() : nullptr;
    if (number < 1 || gobos == nullptr || static_cast<std::size_t>(number) > gobos->size()) return {};
    const Gobo& gobo = (*gobos)[static_cast<std::size_t>(number - 1)];
    if (!gobo.packed || !transmission_of(gobo).empty() || gobo.packed->told.exchange(true)) return {};
    return "the picture of gobo " + std::to_string(number) + " of '" + light.name +
           "' cannot be read, it is open: " + gobo.packed->failed;
}

}  // namespace gonio
