#include "server/scene/light_values.h"

#include "server/scene/scene.h"

namespace gonio {

static constexpr LightRow kRows[] = {
    {Property::position, nullptr, &LightValues::position, &Light::position_rev},
    {Property::pan, &LightValues::pan_rad, nullptr, &Light::aim_rev},
    {Property::tilt, &LightValues::tilt_rad, nullptr, &Light::aim_rev},
    {Property::roll, &LightValues::roll_rad, nullptr, &Light::aim_rev},
    {Property::level, &LightValues::level_ratio, nullptr, &Light::level_rev},
    {Property::color, nullptr, &LightValues::color, &Light::level_rev},
    {Property::tint, &LightValues::tint_duv, nullptr, &Light::level_rev},
    {Property::cct, &LightValues::cct_k, nullptr, &Light::level_rev},
    {Property::shutter, &LightValues::shutter_ratio, nullptr, &Light::level_rev},
    {Property::strobe, &LightValues::strobe_hz, nullptr, &Light::level_rev},
    {Property::zoom, &LightValues::zoom_rad, nullptr, &Light::profile_rev},
    {Property::gobo, &LightValues::gobo, nullptr, &Light::profile_rev},
    {Property::gobo_turn, &LightValues::gobo_rad, nullptr, &Light::profile_rev},
};

std::span<const LightRow> light_rows() {
    return kRows;
}

const LightRow* light_row_of(Property property) {
    const PropertyRow& wanted = row_of(property);
    for (const LightRow& light_row : kRows)
        if (!wanted.field.empty() && row_of(light_row.property).field == wanted.field) return &light_row;
    return nullptr;
}

Numbers numbers_of(const LightValues& light, const LightRow& light_row) {
    if (light_row.number != nullptr) return {light.*light_row.number, 0.0, 0.0};
    const glm::dvec3& vector = light.*light_row.vector;
    return {vector.x, vector.y, vector.z};
}

void set_numbers(LightValues& light, const LightRow& light_row, const Numbers& numbers) {
    if (light_row.number != nullptr)
        light.*light_row.number = numbers[0];
    else
        light.*light_row.vector = {numbers[0], numbers[1], numbers[2]};
}

std::size_t count_of(const LightRow& light_row) {
    return light_row.number != nullptr ? 1 : 3;
}

void write_numbers(google::protobuf::Message& message, std::string_view field, const LightRow& light_row,
                   const Numbers& numbers) {
    write_numbers(message, field, std::span(numbers).first(count_of(light_row)));
}

bool is_taken(const Scene& scene, const std::string& name) {
    return find_light(scene, name) != nullptr || scene.groups.contains(name);
}

}  // namespace gonio
