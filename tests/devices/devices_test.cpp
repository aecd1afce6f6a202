// The project's own device thread on devices that umockdev pretends: found, read, shown, pulled, plugged again.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "protocol/schema/surface.pb.h"
#include "server/surfaces/control_surfaces.h"
#include "tests/devices/mock_devices.h"

namespace gonio::test {
namespace {

class Devices : public testing::Test {
protected:
    void SetUp() override {
        testbed = umockdev_testbed_new();
        hid = std::make_unique<MockHid>(testbed);
        usb = std::make_unique<MockUsbMidi>(testbed);
    }
    void TearDown() override {
        surfaces.reset();
        usb.reset();
        g_object_unref(testbed);
    }
    void start(SurfaceOptions options = {}) {
        auto started = ControlSurfaces::start(options, [] {});
        ASSERT_TRUE(started) << started.error().text();
        surfaces = std::move(*started);
    }
    // Result: the row of a device once `wanted` holds for it; an empty one after 5 s.
    template <typename Wanted>
    v1::SurfaceDevice device(const std::string& identity, const Wanted& wanted) {
        for (int i = 0; i < 500; ++i) {
            if (auto fresh = surfaces->table().try_take()) table = *fresh;
            for (const v1::SurfaceDevice& row : table.table.devices())
                if (row.device() == identity && wanted(row)) return row;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        ADD_FAILURE() << identity << " did not come: " << table.table.ShortDebugString();
        return {};
    }
    v1::SurfaceDevice live(const std::string& identity) {
        return device(identity, [](const v1::SurfaceDevice& row) { return row.state() == "live"; });
    }
    // Result: what the control said next; -99 after 2 s.
    double heard(const std::string& control) {
        for (int i = 0; i < 400; ++i) {
            if (auto updates = surfaces->updates().try_take())
                for (const auto& [key, one] : updates->controls) values[key.second] = one.input;
            if (const auto at = values.find(control); at != values.end()) {
                const double value = at->second.value;
                presses = at->second.presses;
                values.erase(at);
                return value;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        return -99;
    }

    UMockdevTestbed* testbed = nullptr;
    std::unique_ptr<MockHid> hid;
    std::unique_ptr<MockUsbMidi> usb;
    std::unique_ptr<ControlSurfaces> surfaces;
    SurfaceTable table;
    std::map<std::string, ControlInput> values;
    unsigned presses = 0;
};

constexpr const char* kHid = "1209:0001:SN0042";
constexpr const char* kKorg = "0944:0117@1-2";

ByteVector report_with(unsigned slider_2, unsigned buttons) {
    ByteVector report(19);
    report[0] = 1;
    report[3] = static_cast<std::uint8_t>(slider_2);
    report[4] = static_cast<std::uint8_t>(slider_2 >> 8);
    report[17] = static_cast<std::uint8_t>(buttons);
    return report;
}

TEST_F(Devices, AHidBoxIsFoundReadShownPulledAndPluggedAgain) {
    hid->plug();
    start();
    const v1::SurfaceDevice row = live(kHid);
    EXPECT_EQ(row.transport(), "hid");
    ASSERT_EQ(row.controls_size(), 24);
    EXPECT_EQ(row.controls(0).name(), "slider 1");
    EXPECT_EQ(row.controls(0).steps(), 1023u);
    hid->report(report_with(1023, 0));
    EXPECT_EQ(heard("slider 2"), 1.0);
    hid->report(report_with(512, 1));
    EXPECT_DOUBLE_EQ(heard("slider 2"), 512.0 / 1023);
    EXPECT_EQ(heard("button 1"), 1.0);
    EXPECT_EQ(presses, 1u);

    surfaces->show({{kHid, {{"button 3", 1.0}}}});
    EXPECT_EQ(hid->output(), (ByteVector{2, 4, 0}));

    hid->unplug();
    const auto gone = device(kHid, [](const v1::SurfaceDevice& one) { return one.state() != "live"; });
    EXPECT_FALSE(gone.error().empty());
    hid->plug();
    live(kHid);
    EXPECT_EQ(hid->output(), (ByteVector{2, 4, 0})) << "a new box is shown everything";
    hid->report(report_with(100, 0));
    EXPECT_DOUBLE_EQ(heard("slider 2"), 100.0 / 1023);
}

TEST_F(Devices, AUsbMidiBoxIsTakenFromTheKernelReadAndShown) {
    hid->plug();
    start();
    live(kHid);   // the thread runs
    usb->plug();  // and hears of it
    const v1::SurfaceDevice row = live(kKorg);
    ASSERT_EQ(row.transport(), "usb-midi");
    EXPECT_EQ(row.profile(), "Korg nanoKONTROL2");
    EXPECT_EQ(row.product(), "nanoKONTROL2");
    EXPECT_TRUE(usb->detached());
    usb->packets({0x0B, 0xB0, 2, 127});
    EXPECT_EQ(heard("slider 3"), 1.0);
    for (int i = 0; i < 200; ++i) usb->packets({0x0B, 0xB0, 0, static_cast<std::uint8_t>(i % 100)});
    usb->packets({0x0B, 0xB0, 0, 64, 0x0B, 0xB0, 41, 127, 0x0B, 0xB0, 41, 0});
    double value = 0;
    for (int i = 0; i < 100 && value != 64.0 / 127; ++i) value = heard("slider 1");
    EXPECT_DOUBLE_EQ(value, 64.0 / 127) << "the newest counts";
    EXPECT_EQ(heard("play"), 0.0);
    EXPECT_EQ(presses, 1u) << "a press between two looks is not lost";
    EXPECT_GE(usb->most_in_flight(), 2u);
    EXPECT_LE(usb->most_in_flight(), 4u);

    surfaces->show({{kKorg, {{"play", 1.0}}}});
    EXPECT_EQ(usb->output(), (ByteVector{0x0B, 0xB0, 41, 127}));
}

TEST_F(Devices, AUsbMidiBoxThatIsPulledComesBackAndIsShownEverything) {
    usb->plug();
    start();
    live(kKorg);
    surfaces->show({{kKorg, {{"solo 1", 1.0}}}});
    EXPECT_EQ(usb->output(), (ByteVector{0x0B, 0xB0, 32, 127}));
    usb->unplug();
    device(kKorg, [](const v1::SurfaceDevice& one) { return one.state() == "gone"; });
    usb->plug();
    live(kKorg);
    EXPECT_EQ(usb->output(), (ByteVector{0x0B, 0xB0, 32, 127}));
    usb->packets({0x0B, 0xB0, 7, 1});
    EXPECT_DOUBLE_EQ(heard("slider 8"), 1.0 / 127);
}

TEST_F(Devices, ABoxOfAnotherProgramIsNamedAndTakenWhenItIsFree) {
    usb->answer_claims(EBUSY);
    usb->plug();
    start();
    const auto row = device(kKorg, [](const v1::SurfaceDevice& one) { return one.state() == "waiting"; });
    EXPECT_EQ(row.error(), "another program owns it; close that program");
    usb->answer_claims(0);
    live(kKorg);
}

}  // namespace
}  // namespace gonio::test

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (preloaded == nullptr || std::string(preloaded).find("umockdev") == std::string::npos) {
        std::fprintf(stderr, "skipped: this test runs under umockdev-wrapper, which is not installed\n");
        return 77;
    }
    return RUN_ALL_TESTS();
}
