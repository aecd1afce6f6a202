// Sockets of the inputs, on the loopback interface.
#include <gtest/gtest.h>

#include <net/if.h>

#include "protocol/dmx/e131.h"
#include "server/inputs/udp_socket.h"
#include "tests/console/udp.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

TEST(UdpSocket, AnyAddressMeansEveryInterface) {
    const auto all = multicast_interfaces(0);
    const MulticastInterface loopback{static_cast<int>(if_nametoindex("lo")), 0};
    EXPECT_NE(std::find(all.begin(), all.end(), loopback), all.end());
    EXPECT_LE(all.size(), kMaxInterfaces);
    EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
    const auto one = multicast_interfaces(INADDR_LOOPBACK);
    ASSERT_EQ(one.size(), 1u);
    EXPECT_EQ(one[0].address, INADDR_LOOPBACK);
}

std::vector<Datagram> receive(Receiver& receiver, const Descriptor& socket) {
    pollfd ready{socket.fd(), POLLIN, 0};
    poll(&ready, 1, 2000);
    std::uint32_t drops = 0;
    const auto datagrams = receiver.receive(socket, drops);
    return {datagrams.begin(), datagrams.end()};
}

TEST(UdpSocket, AGroupIsHeardOnTheLoopbackInterfaceToo) {
    const auto interfaces = multicast_interfaces(0);
    const auto socket = open_multicast(e131_group(7), 0, interfaces);
    ASSERT_TRUE(socket) << socket.error().text();
    EXPECT_TRUE(join_group(*socket, e131_group(7), interfaces[0])) << "once more is no error";
    const test::Udp desk;  // sends on the loopback interface
    desk.send("239.255.0.7", bound_to(*socket).port, test::Packet(100, 1));
    Receiver receiver(2048);
    const auto datagrams = receive(receiver, *socket);
    ASSERT_EQ(datagrams.size(), 1u);
    EXPECT_EQ(datagrams[0].bytes.size(), 100u);
    EXPECT_FALSE(datagrams[0].truncated);
}

TEST(UdpSocket, AGroupNeedsAnInterface) {
    const auto socket = open_multicast(e131_group(7), 0, {});
    ASSERT_FALSE(socket);
    EXPECT_EQ(socket.error().code, "listen_failed");
}

TEST(UdpSocket, WhatIsTooLongIsTold) {
    const auto socket = open_udp({INADDR_LOOPBACK, 0});
    ASSERT_TRUE(socket);
    const test::Udp desk;
    desk.send("127.0.0.1", bound_to(*socket).port, test::Packet(3000, 1));
    Receiver receiver(2048);
    const auto datagrams = receive(receiver, *socket);
    ASSERT_EQ(datagrams.size(), 1u);
    EXPECT_TRUE(datagrams[0].truncated);
}

TEST(UdpSocket, AddressesAreIpv4) {
    EXPECT_TRUE(parse_peer("0.0.0.0", 1));
    for (const char* text : {"::", "[::1]:5568", "ff18::83:0:0:1", "localhost", "1.2.3.4:", "1.2.3.4:65536"}) {
        const auto peer = parse_peer(text, 1);
        ASSERT_FALSE(peer) << text;
        EXPECT_NE(peer.error().message.find("IPv4"), std::string::npos);
    }
}

}  // namespace
}  // namespace gonio
