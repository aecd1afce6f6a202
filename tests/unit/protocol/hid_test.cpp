// HID by byte vectors: report descriptors, a box that only its descriptor describes, and the boxes of the table.
#include <gtest/gtest.h>

#include <cmath>

#include "protocol/surface/hid_surface.h"

namespace gonio {
namespace {

using ByteVector = std::vector<std::uint8_t>;

// A joystick collection: report 1 has eight 10-bit sliders in 16 bits each and 16 buttons, report 2 takes 16 lamps,
// report 3 is a feature of the vendor's.
const ByteVector kFaderBox = {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x01, 0x05, 0x01, 0x09, 0x36, 0x09, 0x36,
                              0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x09, 0x36, 0x15, 0x00,
                              0x26, 0xFF, 0x03, 0x75, 0x10, 0x95, 0x08, 0x81, 0x02, 0x05, 0x09, 0x19, 0x01, 0x29,
                              0x10, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x10, 0x81, 0x02, 0x85, 0x02, 0x05,
                              0x08, 0x19, 0x01, 0x29, 0x10, 0x75, 0x01, 0x95, 0x10, 0x91, 0x02, 0x85, 0x03, 0x06,
                              0x00, 0xFF, 0x09, 0x01, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x04, 0xB1, 0x02, 0xC0};

std::vector<ControlEvent> take(HidSurface& box, const ByteVector& report) {
    std::vector<ControlEvent> events;
    EXPECT_TRUE(box.take(report, events));
    return events;
}

std::size_t named(const HidSurface& box, const std::string& name) {
    for (std::size_t i = 0; i < box.controls().size(); ++i)
        if (box.controls()[i].name == name) return i;
    ADD_FAILURE() << "no control " << name;
    return 0;
}

double value_in(const std::vector<ControlEvent>& events, std::size_t control) {
    for (const ControlEvent& event : events)
        if (event.control == control) return event.value;
    return NAN;
}

TEST(HidDescriptor, FieldsWithTheirPlaceAndResolution) {
    const auto descriptor = parse_hid_descriptor(kFaderBox);
    ASSERT_TRUE(descriptor);
    EXPECT_TRUE(descriptor->numbered);
    EXPECT_EQ(descriptor->page, 1);
    EXPECT_EQ(descriptor->usage, 4);
    ASSERT_EQ(descriptor->fields.size(), 8u + 16 + 16 + 4);
    EXPECT_EQ(descriptor->fields[7].bit, 112u);
    EXPECT_EQ(descriptor->fields[7].logical_max, 1023);
    EXPECT_EQ(descriptor->fields[8].page, 9);
    EXPECT_EQ(descriptor->fields[8].bit, 128u);
    EXPECT_EQ(descriptor->fields[24].report, HidReport::output);
    EXPECT_EQ(descriptor->fields[24].bit, 0u) << "each report counts its own bits";
}

TEST(HidDescriptor, RefusalsNameTheByte) {
    const auto where = [](ByteVector bytes) {
        const auto refused = parse_hid_descriptor(bytes);
        return refused ? std::string("taken") : refused.error().where;
    };
    EXPECT_EQ(where({0x05}), "byte 0");
    EXPECT_EQ(where({0x05, 0x01, 0x26, 0xFF}), "byte 2");
    EXPECT_EQ(where({0xB4}), "byte 0") << "a pop without a push";
    EXPECT_EQ(where({0x85, 0x00}), "byte 0") << "report id 0";
    EXPECT_EQ(where({0x76, 0xFF, 0xFF, 0x96, 0xFF, 0xFF, 0x81, 0x02}), "byte 6") << "4 GiB of report";
    EXPECT_EQ(where(ByteVector(5000, 0xA0)), "byte 0");
    EXPECT_EQ(where({}), "taken");
}

TEST(HidDescriptor, SignedValuesAndFieldsThatStraddleBytes) {
    // 12-bit x and y, -2048..2047, no report ids.
    const auto descriptor =
        parse_hid_descriptor(ByteVector{0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x09, 0x30, 0x09, 0x31, 0x16, 0x00,
                                        0xF8, 0x26, 0xFF, 0x07, 0x75, 0x0C, 0x95, 0x02, 0x81, 0x02, 0xC0});
    ASSERT_TRUE(descriptor);
    ASSERT_EQ(descriptor->fields.size(), 2u);
    const ByteVector report = {0xFF, 0x3F, 0x12};
    EXPECT_EQ(hid_value(descriptor->fields[0], report), -1);
    EXPECT_EQ(hid_value(descriptor->fields[1], report), 0x123);
    EXPECT_FALSE(has_hid_field(descriptor->fields[1], Bytes(report).first(2)));
}

TEST(HidSurface, AnyDeviceByItsDescriptor) {
    auto box = HidSurface::open(0x1209, 0x0001, kFaderBox);
    ASSERT_TRUE(box);
    ASSERT_EQ(box->controls().size(), 24u);
    EXPECT_EQ(box->controls()[0].name, "slider 1");
    EXPECT_EQ(box->controls()[0].steps, 1023u);
    EXPECT_EQ(box->controls()[8].name, "button 1");
    EXPECT_EQ(box->controls()[8].kind, ControlKind::button);
    ByteVector report(19);
    report[0] = 1;
    report[3] = 0xFF;
    report[4] = 0x03;   // slider 2 at its end
    report[18] = 0x80;  // button 16
    auto events = take(*box, report);
    EXPECT_EQ(value_in(events, 1), 1.0);
    EXPECT_EQ(value_in(events, 0), 0.0) << "the first report says where everything stands";
    EXPECT_EQ(value_in(events, named(*box, "button 16")), 1.0);
    EXPECT_TRUE(std::isnan(value_in(events, named(*box, "button 1")))) << "a button that was never pressed";
    report[1] = 1;
    events = take(*box, report);
    ASSERT_EQ(events.size(), 1u) << "then only what changes";
    EXPECT_DOUBLE_EQ(events[0].value, 1.0 / 1023);
    report[4] = 0x07;  // beyond its range: it says nothing
    EXPECT_TRUE(take(*box, report).empty());
    std::vector<ControlEvent> none;
    EXPECT_FALSE(box->take(ByteVector{9, 1, 2}, none)) << "another report";
    EXPECT_FALSE(box->take(ByteVector{}, none));
    EXPECT_FALSE(box->take(ByteVector{1, 5}, none)) << "a cut report";
    EXPECT_TRUE(none.empty());
}

TEST(HidSurface, LampsOfTheDescriptorBelongToItsButtons) {
    auto box = HidSurface::open(0x1209, 0x0001, kFaderBox);
    ASSERT_TRUE(box);
    EXPECT_EQ(box->show(named(*box, "button 1"), 1), (ByteVector{2, 1, 0}));
    EXPECT_EQ(box->show(named(*box, "button 10"), 1), (ByteVector{2, 1, 2})) << "the others stay as they were";
    EXPECT_EQ(box->show(named(*box, "button 1"), 0), (ByteVector{2, 0, 2}));
    EXPECT_TRUE(box->show(0, 1).empty()) << "a slider without a motor";
}

TEST(HidSurface, RelativeAxesAndArraysOfButtons) {
    // A wheel of 8 bits, relative; an array of two slots for buttons 1 to 8.
    auto box = HidSurface::open(1, 2, ByteVector{0x05, 0x01, 0x09, 0x08, 0xA1, 0x01, 0x09, 0x38, 0x15, 0x81, 0x25, 0x7F,
                                                 0x75, 0x08, 0x95, 0x01, 0x81, 0x06, 0x05, 0x09, 0x19, 0x01, 0x29, 0x08,
                                                 0x15, 0x01, 0x25, 0x08, 0x75, 0x08, 0x95, 0x02, 0x81, 0x00, 0xC0});
    ASSERT_TRUE(box) << box.error().text();
    const std::size_t wheel = named(*box, "wheel"), three = named(*box, "button 3"), five = named(*box, "button 5");
    EXPECT_EQ(box->controls()[wheel].kind, ControlKind::relative);
    EXPECT_EQ(value_in(take(*box, {0xFE, 3, 5}), wheel), -2);
    auto events = take(*box, {0, 5, 0});
    ASSERT_EQ(events.size(), 1u) << "5 stays, in another slot";
    EXPECT_EQ(events[0].control, three);
    EXPECT_EQ(value_in(take(*box, {0, 0, 0}), five), 0);
}

TEST(HidSurface, ShuttlePro) {
    auto box = HidSurface::open(0x0b33, 0x0030, {});
    ASSERT_TRUE(box);
    take(*box, {0, 250, 0, 0, 0});
    auto events = take(*box, {0xF9, 3, 0, 0x01, 0x40});  // shuttle -7, jog on by 9 over the wrap, buttons 1 and 15
    EXPECT_EQ(value_in(events, named(*box, "shuttle")), 0.0);
    EXPECT_EQ(value_in(events, named(*box, "jog")), 9);
    EXPECT_EQ(value_in(events, named(*box, "button 1")), 1);
    EXPECT_EQ(value_in(events, named(*box, "button 15")), 1);
    EXPECT_TRUE(box->controls()[0].centred);
    std::vector<ControlEvent> none;
    EXPECT_FALSE(box->take(ByteVector{0, 1, 0}, none));
}

TEST(HidSurface, PowerMate) {
    auto box = HidSurface::open(0x077d, 0x0410, {});
    ASSERT_TRUE(box);
    const auto events = take(*box, {1, 0xFD, 0, 0, 0, 0});
    EXPECT_EQ(value_in(events, 0), -3);
    EXPECT_EQ(value_in(events, 1), 1);
    EXPECT_EQ(box->show(0, 0.5), (ByteVector{0, 128}));
}

TEST(HidSurface, SpaceMouseOldAndNew) {
    auto box = HidSurface::open(0x256f, 0xc635, {});
    ASSERT_TRUE(box);
    auto events = take(*box, {1, 0x5E, 0x01, 0, 0, 0xA2, 0xFE});  // x 350, z -350
    EXPECT_EQ(value_in(events, 0), 1.0);
    EXPECT_EQ(value_in(events, 1), 0.5);
    EXPECT_EQ(value_in(events, 2), 0.0);
    EXPECT_EQ(value_in(take(*box, {2, 0xAF, 0x00, 0, 0, 0, 0}), 3), 0.75);
    EXPECT_EQ(value_in(take(*box, {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x5E, 0x01}), 5), 1.0) << "six axes in one";
    EXPECT_EQ(value_in(take(*box, {3, 2}), named(*box, "button 2")), 1);
    EXPECT_EQ(box->hello(), (ByteVector{4, 1}));
}

TEST(HidSurface, StreamDeckPlus) {
    auto box = HidSurface::open(0x0fd9, 0x0084, {});
    ASSERT_TRUE(box);
    auto events = take(*box, {1, 3, 5, 0, 1, 0xFF, 0, 2, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(value_in(events, named(*box, "dial 1")), -1);
    EXPECT_EQ(value_in(events, named(*box, "dial 3")), 2);
    events = take(*box, {1, 3, 5, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
    EXPECT_EQ(value_in(events, named(*box, "dial push 2")), 1);
    events = take(*box, {1, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0});
    EXPECT_EQ(value_in(events, named(*box, "button 8")), 1);
    events = take(*box, {1, 2, 14, 0, 1, 0, 0x1F, 0x03, 50, 0, 0, 0, 0, 0});
    EXPECT_EQ(value_in(events, named(*box, "strip")), 1.0);
}

TEST(HidSurface, XKeys) {
    auto box = HidSurface::open(0x05f3, 0x0405, {});
    ASSERT_TRUE(box);
    const auto events = take(*box, {0, 0, 0x01, 0x20, 0, 0x02});
    EXPECT_EQ(value_in(events, named(*box, "button 1")), 1);
    EXPECT_EQ(value_in(events, named(*box, "button 12")), 1);
    EXPECT_EQ(value_in(events, named(*box, "button 20")), 1);
    const ByteVector lamp = box->show(named(*box, "button 8"), 1);
    EXPECT_EQ(lamp.size(), 36u);
    EXPECT_EQ(lamp[1], 181);
    EXPECT_EQ(lamp[2], 9) << "second column, second row";
    EXPECT_EQ(lamp[3], 1);
}

TEST(HidSurface, WhatIsABoxAndWhatIsNot) {
    EXPECT_TRUE(is_control_box(0x1209, 1, 1, 4));
    EXPECT_TRUE(is_control_box(0x0fd9, 0x0084, 0x0C, 1));
    EXPECT_FALSE(is_control_box(0x046d, 0xc31c, 1, 6)) << "a keyboard";
    EXPECT_FALSE(is_control_box(0x046d, 0xc077, 1, 2)) << "a mouse";
    EXPECT_FALSE(is_control_box(0x1050, 0x0407, 0xF1D0, 1)) << "a security key";
    EXPECT_TRUE(is_control_box(0x1209, 1, 0x0C, 1)) << "a knob";
    EXPECT_FALSE(is_control_box(0x1209, 1, 0x0C, 1, true)) << "a keyboard's media keys";
    EXPECT_TRUE(is_control_box(0x0fd9, 0x0084, 0x0C, 1, true)) << "one that is known";
    EXPECT_TRUE(is_of_people(1, 6) && is_of_people(1, 2) && is_of_people(0x0D, 4) && is_of_people(0xF1D0, 1));
    EXPECT_FALSE(is_of_people(0x0C, 1) || is_of_people(1, 4));
    EXPECT_FALSE(HidSurface::open(1, 2, ByteVector{0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0xC0})) << "nothing to move";
}

}  // namespace
}  // namespace gonio
