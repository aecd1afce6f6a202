// What goniod --doctor makes of a machine that the tests put in, and the lines of the log.
#include "server/app/doctor.h"

#include <gtest/gtest.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "server/app/log.h"
#include "server/inputs/udp_socket.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;
using State = Finding::State;

// A machine in a folder: whose groups and rights are said by the test.
struct DoctorTest : testing::Test {
    fs::path root = fs::temp_directory_path() / ("gonio-doctor-" + std::to_string(getpid()));
    std::string closed, group = "root";  // the file that may not be used, and its group
    bool group_open = true;              // which may use it
    Options options;
    Machine machine;
    DoctorTest() {
        fs::create_directories(root);
        machine.root = root;
        machine.may_use = [this](const std::string& path) { return closed.empty() || !path.ends_with(closed); };
        machine.group_of = [this](const std::string& path) {
            return !closed.empty() && path.ends_with(closed) ? group : "root";
        };
        machine.group_may_use = [this](const std::string&) { return group_open; };
        machine.clock_state = [] { return TIME_OK; };
        machine.receive_bytes = [] { return 0LL; };
    }
    ~DoctorTest() override { fs::remove_all(root); }
    void file(const std::string& name) const {
        fs::create_directories((root / name).parent_path());
        std::ofstream(root / name).put('\n');
    }
};

TEST_F(DoctorTest, AMachineWithoutDevicesIsWell) {
    const auto findings = check_devices(options, machine);
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].state, State::ok);
}

TEST_F(DoctorTest, AGpuOfAnotherGroupIsToldWithTheGroup) {
    file("dev/dri/renderD128");
    file("dev/dri/card0");  // of no use to a server without a screen
    EXPECT_EQ(check_devices(options, machine)[0].state, State::ok);
    closed = "renderD128", group = "render";
    const auto findings = check_devices(options, machine);
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].state, State::warning);
    EXPECT_NE(findings[0].mend.find("usermod -aG render "), std::string::npos) << findings[0].mend;
    const auto names_no_group = [&] {
        return check_devices(options, machine)[0].mend.find("usermod") == std::string::npos;
    };
    group = "root";
    EXPECT_TRUE(names_no_group()) << "root's group has more than a GPU";
    group = "";
    EXPECT_TRUE(names_no_group()) << "the group has no name";
    group = "render", group_open = false;
    EXPECT_TRUE(names_no_group()) << "0600: being in it helps nobody";
}

TEST_F(DoctorTest, WhatIsWrongWithOptionsIsAFindingEach) {
    EXPECT_EQ(check_options(options)[0].state, State::ok);
    options.faults = {"listening on 0.0.0.0 needs --token-file: only loopback addresses may go without",
                      "a.toml line 3: x"};
    const auto findings = check_options(options);
    ASSERT_EQ(findings.size(), 2u);
    for (const Finding& finding : findings) EXPECT_EQ(finding.state, State::fault);
    EXPECT_NE(findings[0].mend.find("GONIOD_TOKEN_FILE=/etc/goniod/token"), std::string::npos);
    EXPECT_NE(findings[1].found.find("a.toml line 3"), std::string::npos);
}

TEST_F(DoctorTest, FaderBoxesNeedTheRulesAndTheGroup) {
    file("dev/hidraw0");
    auto findings = check_devices(options, machine);
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_NE(findings[0].found.find("70-gonio.rules"), std::string::npos);
    file("usr/lib/udev/rules.d/70-gonio.rules");
    EXPECT_EQ(check_devices(options, machine)[0].state, State::ok);
    closed = "hidraw0", group = "root";  // a keyboard
    EXPECT_EQ(check_devices(options, machine)[0].state, State::ok);
    group = "gonio";
    findings = check_devices(options, machine);
    EXPECT_EQ(findings[0].state, State::warning);
    EXPECT_NE(findings[0].mend.find("usermod -aG gonio "), std::string::npos);
    options.surfaces = false;
    EXPECT_EQ(check_devices(options, machine)[0].state, State::ok);
}

TEST_F(DoctorTest, ATakenPortIsAFaultAndAFreeOneNone) {
    const auto taken = open_tcp({0x7F000001, 0});
    ASSERT_TRUE(taken) << taken.error().text();
    options.port = bound_to(*taken).port;
    auto findings = check_ports(options);
    EXPECT_EQ(findings[0].state, State::fault);
    EXPECT_FALSE(findings[0].mend.empty());
    options.port = 0;
    EXPECT_EQ(check_ports(options)[0].state, State::ok);
    options.host = "192.0.2.1";  // RFC 5737: no machine has it
    EXPECT_EQ(check_ports(options)[0].state, State::fault);
    options.inputs.sacn = UdpPeer{0xC0000201, 0};
    EXPECT_NE(check_ports(options)[1].mend.find("an address of this machine"), std::string::npos);
}

TEST_F(DoctorTest, ClockAndBuffers) {
    EXPECT_EQ(check_time(machine).state, State::ok);
    machine.clock_state = [] { return TIME_ERROR; };
    EXPECT_EQ(check_time(machine).state, State::warning);
    EXPECT_EQ(check_buffers(options, machine).state, State::ok) << "nobody listens to consoles";
    options.inputs.sacn = UdpPeer{0, 5568};
    EXPECT_EQ(check_buffers(options, machine).state, State::warning);
    machine.receive_bytes = [] { return static_cast<long long>(kReceiveBytes); };
    EXPECT_EQ(check_buffers(options, machine).state, State::ok);
}

TEST_F(DoctorTest, DescriptorsAreThoseOfTheConnectionsAndSomeMore) {
    options.limits.connections = 1000;
    EXPECT_EQ(check_descriptors(options, 1000).state, State::warning);
    EXPECT_EQ(check_descriptors(options, 1064).state, State::ok);
}

TEST(Doctor, TextNamesTheMendBelowAndJsonIsALineEach) {
    const std::vector<Finding> findings{{"egl", State::ok, "A.", ""}, {"port", State::fault, "B \"x\".", "C"}};
    EXPECT_EQ(findings_text(findings, false),
              "ok       egl          A.\nfault    port         B \"x\".\n                      mend: C\n");
    EXPECT_EQ(findings_text(findings, true),
              "{\"check\":\"egl\",\"state\":\"ok\",\"found\":\"A.\",\"mend\":\"\"}\n"
              "{\"check\":\"port\",\"state\":\"fault\",\"found\":\"B \\\"x\\\".\",\"mend\":\"C\"}\n");
}

TEST(Log, AnEntryIsOneLineOfJson) {
    EXPECT_EQ(log_line_json(1'000'000'000'123, "warning", "a \"b\"\nc"),
              "{\"time\":\"2001-09-09T01:46:40.123Z\",\"level\":\"warning\",\"message\":\"a \\\"b\\\"\\nc\"}");
    EXPECT_NE(log_line_json(0, "info", "\xFF").find("\xEF\xBF\xBD"), std::string::npos) << "no UTF-8";
}

}  // namespace
}  // namespace gonio
