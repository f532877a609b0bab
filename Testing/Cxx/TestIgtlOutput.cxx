// What a client of OpenIGTLink receives.
#include "IgtlOutput.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <chrono>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlMessageHeader.h>
#include <igtlTransformMessage.h>
#include <memory>
#include <string>
#include <thread>

namespace TestIgtlOutput
{
using namespace coronary;

namespace
{
/// On a port that nobody has.
std::unique_ptr<IgtlOutput> FreeOutput(int& port)
{
  for (port = 28944; port < 29044; ++port)
  {
    try
    {
      return std::make_unique<IgtlOutput>(port);
    }
    catch (const std::runtime_error&)
    {
      continue;
    }
  }
  return nullptr;
}

bool WaitFor(const IgtlOutput& output, bool client)
{
  for (int n = 0; n < 500 && output.HasClient() != client; ++n)
  {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return output.HasClient() == client;
}

igtl::ClientSocket::Pointer Connected(int port)
{
  const igtl::ClientSocket::Pointer client = igtl::ClientSocket::New();
  EXPECT_EQ(client->ConnectToServer("127.0.0.1", port), 0);
  client->SetReceiveTimeout(5000);
  return client;
}

igtl::MessageHeader::Pointer Header(igtl::ClientSocket& client)
{
  const igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  header->InitPack();
  EXPECT_EQ(client.Receive(header->GetPackPointer(), static_cast<int>(header->GetPackSize())),
    static_cast<int>(header->GetPackSize()));
  header->Unpack();
  return header;
}

template <typename Message>
typename Message::Pointer Received(igtl::ClientSocket& client, const std::string& type)
{
  const igtl::MessageHeader::Pointer header = Header(client);
  EXPECT_EQ(header->GetDeviceType(), type);
  typename Message::Pointer message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto size = static_cast<int>(message->GetPackBodySize());
  EXPECT_EQ(client.Receive(message->GetPackBodyPointer(), size), size);
  EXPECT_NE(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY, 0); // its checksum is right
  return message;
}
}

TEST(IgtlOutput, PosesAndImages)
{
  int port = 0;
  const std::unique_ptr<IgtlOutput> output = FreeOutput(port);
  ASSERT_TRUE(output);
  igtl::ClientSocket::Pointer client = Connected(port);
  ASSERT_TRUE(WaitFor(*output, true));
  ToolPose pose;
  pose.axes = { Vector3(0, 1, 0), Vector3(0, 0, 1), Vector3(1, 0, 0) };
  pose.origin = Vector3(10, -20, 30);
  output->SendPose("wire tip", pose, 12.5);
  const auto transform = Received<igtl::TransformMessage>(*client, "TRANSFORM");
  EXPECT_EQ(std::string(transform->GetDeviceName()), "wire tip");
  igtl::Matrix4x4 matrix;
  transform->GetMatrix(matrix);
  const float expected[3][4] = { { 0, 0, -1, -10 }, { -1, 0, 0, 20 }, { 0, 1, 0, 30 } };
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 4; ++column)
    {
      EXPECT_EQ(matrix[row][column], expected[row][column]) << row << column;
    }
  }
  igtl::TimeStamp::Pointer time = igtl::TimeStamp::New();
  transform->GetTimeStamp(time);
  EXPECT_NEAR(time->GetTimeStamp(), 12.5, 1e-6);

  GreyImage image;
  image.columns = 37;
  image.rows = 21;
  for (int n = 0; n < 37 * 21; ++n)
  {
    image.values.push_back(static_cast<std::uint8_t>(n * 83));
  }
  output->SendImage("fluoroscopy", image, 0.4, 12.6);
  const auto received = Received<igtl::ImageMessage>(*client, "IMAGE");
  int size[3];
  received->GetDimensions(size);
  EXPECT_EQ(size[0], 37);
  EXPECT_EQ(size[1], 21);
  EXPECT_EQ(size[2], 1);
  float spacing[3];
  received->GetSpacing(spacing);
  EXPECT_FLOAT_EQ(spacing[1], 0.4F);
  const auto* bytes = static_cast<const unsigned char*>(received->GetScalarPointer());
  for (std::size_t n = 0; n < image.values.size(); ++n)
  {
    ASSERT_EQ(bytes[n], image.values[n]) << n;
  }

  // The client goes, and another one comes.
  client->CloseSocket();
  for (int n = 0; n < 500 && output->HasClient(); ++n)
  {
    output->SendPose("wire tip", pose, 13.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(output->HasClient());
  client = Connected(port);
  ASSERT_TRUE(WaitFor(*output, true));
  output->SendPose("wire tip", pose, 14.0);
  EXPECT_EQ(std::string(Header(*client)->GetDeviceType()), "TRANSFORM");
  EXPECT_THROW(IgtlOutput{ port }, std::runtime_error); // is taken
}

TEST(IgtlOutput, OtherMachinesReachItOnlyWhenAsked)
{
  int port = 0;
  const std::unique_ptr<IgtlOutput> local = FreeOutput(port);
  ASSERT_TRUE(local);
  // Another address of this machine stands for another machine: what listens at 127.0.0.1 is not there.
  const igtl::ClientSocket::Pointer client = igtl::ClientSocket::New();
  EXPECT_NE(client->ConnectToServer("127.0.0.2", port), 0);
  // At that address the same port is free, and can be had.
  const IgtlOutput other(port, "127.0.0.2");
  EXPECT_EQ(igtl::ClientSocket::New()->ConnectToServer("127.0.0.2", port), 0);
  EXPECT_TRUE(IgtlOutput::IsLocal("127.0.0.1"));
  EXPECT_FALSE(IgtlOutput::IsLocal("0.0.0.0"));
  EXPECT_FALSE(IgtlOutput::IsLocal("192.168.0.1"));
}

TEST(IgtlOutput, ASecondClientIsTurnedAway)
{
  int port = 0;
  const std::unique_ptr<IgtlOutput> output = FreeOutput(port);
  ASSERT_TRUE(output);
  const igtl::ClientSocket::Pointer first = Connected(port);
  ASSERT_TRUE(WaitFor(*output, true));
  const igtl::ClientSocket::Pointer second = Connected(port);
  char byte = 0;
  EXPECT_EQ(second->Receive(&byte, 1), 0); // the end, not a wait
  output->SendPose("wire tip", ToolPose(), 1.0);
  EXPECT_EQ(std::string(Header(*first)->GetDeviceType()), "TRANSFORM");
}

TEST(IgtlOutput, AClientThatReadsNothingIsDropped)
{
  int port = 0;
  const std::unique_ptr<IgtlOutput> output = FreeOutput(port);
  ASSERT_TRUE(output);
  const igtl::ClientSocket::Pointer lazy = Connected(port);
  ASSERT_TRUE(WaitFor(*output, true));
  GreyImage image;
  image.columns = 2048;
  image.rows = 2048;
  image.values.assign(2048 * 2048, 7);
  // More than any buffer of the system holds; none of these calls may wait for the client, or the test ends by its limit.
  for (int n = 0; n < 1000 && output->HasClient(); ++n)
  {
    output->SendImage("fluoroscopy", image, 0.2, n);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(WaitFor(*output, false));
  const igtl::ClientSocket::Pointer next = Connected(port);
  EXPECT_TRUE(WaitFor(*output, true));
}

TEST(IgtlOutput, WhatIsRefused)
{
  ExpectRefusal([] { IgtlOutput output(28944, "localhost"); }, "'localhost' is no address");
  ExpectError([] { IgtlOutput output(28944, "203.0.113.7"); }, "203.0.113.7, port 28944");
  ExpectRefusal([] { IgtlOutput output(0); }, "port 0");
  ExpectRefusal([] { IgtlOutput output(70000); }, "port 70000");
  int port = 0;
  const std::unique_ptr<IgtlOutput> output = FreeOutput(port);
  ASSERT_TRUE(output);
  ExpectRefusal(
    [&] {
      output->SendImage("x", GreyImage{ 2, 2, { 1, 2, 3 } }, 1.0, 0.0);
    },
    "3 pixels");
  ExpectRefusal([&] { output->SendImage("x", GreyImage{ 1, 1, { 1 } }, 0.0, 0.0); }, "spacing");
}
}
