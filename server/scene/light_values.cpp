#include "server/scene/light_values.h"

namespace gonio {

static constexpr LightSlot kSlots[] = {
    {Property::position, nullptr, &LightValues::position, &Light::position_rev},
    {Property::pan, &LightValues::pan_rad, nullptr, &Light::aim_rev},
    {Property::tilt, &LightValues::tilt_rad, nullptr, &Light::aim_rev},
    {Property::roll, &LightValues::roll_rad, nullptr, &Light::aim_rev},
    {Property::level, &LightValues::level_ratio, nullptr, &Light::level_rev},
    {Property::color, nullptr, &LightValues::color, &Light::level_rev},
    {Property::tint, &LightValues::tint_duv, nullptr, &Light::level_rev},
};

std::span<const LightSlot> light_slots() {
    return kSlots;
}

const LightSlot* slot_of(Property property) {
    const PropertyRow& wanted = row_of(property);
    for (const LightSlot& slot : kSlots)
        if (!wanted.field.empty() && row_of(slot.property).field == wanted.field) return &slot;
    return nullptr;
}

Numbers numbers_of(const LightValues& light, const LightSlot& slot) {
    if (slot.number != nullptr) return {light.*slot.number, 0.0, 0.0};
    const glm::dvec3& vector = light.*slot.vector;
    return {vector.x, vector.y, vector.z};
}

void set_numbers(LightValues& light, const LightSlot& slot, const Numbers& numbers) {
    if (slot.number != nullptr)
        light.*slot.number = numbers[0];
    else
        light.*slot.vector = {numbers[0], numbers[1], numbers[2]};
}

std::size_t count_of(const LightSlot& slot) {
    return slot.number != nullptr ? 1 : 3;
}

void write_numbers(google::protobuf::Message& message, std::string_view field, const LightSlot& slot,
                   const Numbers& numbers) {
    write_numbers(message, field, std::span(numbers).first(count_of(slot)));
}

}  // namespace gonio
