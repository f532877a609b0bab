#include "IgtlOutput.h"

#include <stdexcept>

#ifdef DYNAMICCORONARY_WITH_IGTL
#include <arpa/inet.h>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstring>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlServerSocket.h>
#include <igtlTransformMessage.h>
#include <mutex>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <thread>
#include <utility>
#endif

namespace coronary
{
#ifdef DYNAMICCORONARY_WITH_IGTL
namespace
{
constexpr unsigned long Patience = 50; // ms between looks at whether it is to end

struct NamedPose
{
  std::string name;
  ToolPose pose;
  double seconds = 0.0;
  bool fresh = false;
};

struct NamedImage
{
  std::string name;
  GreyImage image;
  double spacing = 1.0;
  double seconds = 0.0;
  bool fresh = false;
};

template <typename Message>
bool Send(igtl::ClientSocket& client, Message& message, const std::string& name, double seconds)
{
  igtl::TimeStamp::Pointer time = igtl::TimeStamp::New();
  time->SetTime(seconds);
  message.SetDeviceName(name.c_str());
  message.SetTimeStamp(time);
  message.Pack();
  return client.Send(message.GetPackPointer(), static_cast<int>(message.GetPackSize())) != 0;
}

bool Send(igtl::ClientSocket& client, const NamedPose& named)
{
  igtl::Matrix4x4 matrix = {};
  for (int row = 0; row < 3; ++row)
  {
    const double sign = row < 2 ? -1.0 : 1.0; // LPS to RAS
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      matrix[row][axis] = static_cast<float>(sign * named.pose.axes[axis][row]);
    }
    matrix[row][3] = static_cast<float>(sign * named.pose.origin[row]);
  }
  matrix[3][3] = 1.0F;
  const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  message->SetMatrix(matrix);
  return Send(client, *message, named.name, named.seconds);
}

bool Send(igtl::ClientSocket& client, const NamedImage& named)
{
  const GreyImage& image = named.image;
  const auto spacing = static_cast<float>(named.spacing);
  const igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
  message->SetDimensions(image.columns, image.rows, 1);
  message->SetSpacing(spacing, spacing, 1.0F);
  message->SetScalarTypeToUint8();
  message->AllocateScalars();
  std::memcpy(message->GetScalarPointer(), image.values.data(), image.values.size());
  return Send(client, *message, named.name, named.seconds);
}

/// The library's server listens at all addresses.
class ServerAtAddress : public igtl::ServerSocket
{
public:
  using Self = ServerAtAddress;
  using Pointer = igtl::SmartPointer<Self>;
  igtlNewMacro(ServerAtAddress);

  /// @throws std::runtime_error saying why not
  void Open(const in_addr& address, int port)
  {
    this->m_SocketDescriptor = this->CreateSocket();
    sockaddr_in place = {};
    place.sin_family = AF_INET;
    place.sin_addr = address;
    place.sin_port = htons(static_cast<std::uint16_t>(port));
    const int again = 1; // the port of a session that has just ended
    if (this->m_SocketDescriptor < 0 ||
      setsockopt(this->m_SocketDescriptor, SOL_SOCKET, SO_REUSEADDR, &again, sizeof(again)) != 0 ||
      bind(this->m_SocketDescriptor, reinterpret_cast<const sockaddr*>(&place), sizeof(place)) !=
        0 ||
      listen(this->m_SocketDescriptor, 1) != 0)
    {
      const std::string reason = std::strerror(errno);
      this->CloseSocket();
      throw std::runtime_error(reason);
    }
  }

protected:
  ServerAtAddress() = default;
};

/// Writing to a client that has gone must be an error, and not the end of the program.
void BlockBrokenPipe()
{
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}
}

struct IgtlOutput::Internals
{
  ServerAtAddress::Pointer server = ServerAtAddress::New();
  std::mutex mutex;
  std::condition_variable news;
  NamedPose pose;
  NamedImage image;
  std::atomic<bool> stopping{ false };
  std::atomic<bool> connected{ false };
  std::thread thread;

  void Serve()
  {
    BlockBrokenPipe();
    while (!this->stopping)
    {
      const igtl::ClientSocket::Pointer client = this->server->WaitForConnection(Patience);
      if (client.IsNotNull())
      {
        client->SetSendTimeout(1000);
        this->connected = true;
        this->Feed(*client);
        this->connected = false;
        client->CloseSocket();
      }
    }
  }

  void Feed(igtl::ClientSocket& client)
  {
    while (!this->stopping)
    {
      NamedPose nextPose;
      NamedImage nextImage;
      {
        std::unique_lock<std::mutex> lock(this->mutex);
        this->news.wait_for(lock, std::chrono::milliseconds(Patience),
          [this] { return this->stopping || this->pose.fresh || this->image.fresh; });
        nextPose = std::exchange(this->pose, {});
        nextImage = std::exchange(this->image, {});
      }
      // Who waits at the port is not left to wait.
      if (const igtl::ClientSocket::Pointer other = this->server->WaitForConnection(1))
      {
        other->CloseSocket();
      }
      if ((nextPose.fresh && !Send(client, nextPose)) ||
        (nextImage.fresh && !Send(client, nextImage)))
      {
        return;
      }
    }
  }
};

bool IgtlOutput::IsSupported()
{
  return true;
}

IgtlOutput::IgtlOutput(int port, const std::string& address)
  : Data(std::make_unique<Internals>())
{
  if (port < 1 || port > 65535)
  {
    throw std::invalid_argument(
      "The port " + std::to_string(port) + " of OpenIGTLink is not from 1 to 65535.");
  }
  in_addr place = {};
  if (inet_pton(AF_INET, address.c_str(), &place) != 1)
  {
    throw std::invalid_argument(
      "'" + address + "' is no address for OpenIGTLink: four numbers like 127.0.0.1 are wanted.");
  }
  try
  {
    this->Data->server->Open(place, port);
  }
  catch (const std::runtime_error& error)
  {
    throw std::runtime_error("OpenIGTLink can not listen at " + address + ", port " +
      std::to_string(port) + ": " + error.what() + ".");
  }
  this->Data->thread = std::thread([this] { this->Data->Serve(); });
}

IgtlOutput::~IgtlOutput()
{
  {
    const std::lock_guard<std::mutex> lock(this->Data->mutex);
    this->Data->stopping = true;
  }
  this->Data->news.notify_all();
  this->Data->thread.join();
  this->Data->server->CloseSocket();
}

void IgtlOutput::SendPose(const std::string& name, const ToolPose& pose, double seconds)
{
  {
    const std::lock_guard<std::mutex> lock(this->Data->mutex);
    this->Data->pose = { name, pose, seconds, true };
  }
  this->Data->news.notify_one();
}

void IgtlOutput::SendImage(const std::string& name, GreyImage image, double spacing, double seconds)
{
  constexpr int Most = 16384;
  if (image.columns < 1 || image.rows < 1 || image.columns > Most || image.rows > Most ||
    !(spacing > 0.0) ||
    image.values.size() !=
      static_cast<std::size_t>(image.columns) * static_cast<std::size_t>(image.rows))
  {
    throw std::invalid_argument("The image '" + name + "' has " +
      std::to_string(image.values.size()) + " pixels, " + std::to_string(image.columns) + " by " +
      std::to_string(image.rows) + " and a spacing of " + std::to_string(spacing) + " mm.");
  }
  {
    const std::lock_guard<std::mutex> lock(this->Data->mutex);
    this->Data->image = { name, std::move(image), spacing, seconds, true };
  }
  this->Data->news.notify_one();
}

bool IgtlOutput::HasClient() const
{
  return this->Data->connected;
}
#else
struct IgtlOutput::Internals
{
};

bool IgtlOutput::IsSupported()
{
  return false;
}

IgtlOutput::IgtlOutput(int /*port*/, const std::string& /*address*/)
{
  throw std::runtime_error("This build has no OpenIGTLink.");
}

IgtlOutput::~IgtlOutput() = default;

void IgtlOutput::SendPose(const std::string& /*name*/, const ToolPose& /*pose*/, double /*seconds*/)
{
}

void IgtlOutput::SendImage(
  const std::string& /*name*/, GreyImage /*image*/, double /*spacing*/, double /*seconds*/)
{
}

bool IgtlOutput::HasClient() const
{
  return false;
}
#endif

bool IgtlOutput::IsLocal(const std::string& address)
{
  return address.rfind("127.", 0) == 0;
}
}
