// The C# client under Mono: the vectors in a file, or a session of the service at an address.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Net;
using FarmAr;
using Values = System.Collections.Generic.Dictionary<string, object>;

static class CheckClient
{
    static int Main(string[] arguments)
    {
        if (arguments[0] == "vectors") Vectors(arguments[1]);
        else Flow(arguments[1], arguments.Length > 2 ? arguments[2] : null);
        return 0;
    }

    static void Vectors(string path)
    {
        var every = (List<object>)((Values)Json.Read(File.ReadAllText(path)))["vectors"];
        int wrong = 0;
        foreach (Values one in every)
        {
            var labels = (List<object>)one["labels"];
            var costs = (List<object>)one["costs"];
            var found = new Spatial((Values)one["layout"]).Identify((Values)one["snapshot"]).Answers;
            bool right = found.Count == labels.Count;
            for (int i = 0; right && i < labels.Count; i++)
            {
                bool near = costs[i] == null
                    ? double.IsNaN(found[i].Cost)
                    : Math.Abs(found[i].Cost - (double)costs[i]) <= 1e-9 * (1 + (double)costs[i]);
                right = found[i].Id == (string)labels[i] && near && (found[i].Id == null) == (found[i].Reason != null);
            }
            if (!right) wrong++;
        }
        Console.WriteLine(every.Count + " vectors, " + wrong + " wrong");
    }

    static Thing At(string id, double x, double z, double yaw)
    {
        return new Thing
        {
            Id = id, Category = "chäir \"\u0001\"", X = x, Z = z, Size = new[] { 0.5, 1, 0.4 },
            Rotation = new[] { 0, Math.Sin(yaw / 2), 0, Math.Cos(yaw / 2) },
        };
    }

    static string Said(Reply reply)
    {
        return string.Join(",", reply.Answers.Select(one => one.Id ?? "-").ToArray()) + (reply.Offline ? " offline" : "");
    }

    static void Flow(string url, string pin)
    {
        var session = new Session(url, "from-mono") { Pin = pin, Token = pin == null ? null : "sesame", TimeoutMs = 60000 };
        session.Begin(new[] { At("a", 0, 0, 0.1), At("b", 2, 0, 0.2), At("c", 0, 3, 0.3) }, "spatial", true);
        Func<Thing[]> seen = () => new[] { At("d0", 2.1, 0.1, 0.2), At("d1", 0.1, 3, 0.3), At("d2", 0.1, 0, 0.1) };
        var eye = new Eye { Z = -2, Range = 10 };
        Console.WriteLine(Said(session.Identify(eye, seen(), 1.5)));
        session.Confirm(new Dictionary<string, string> { { "d0", "c" }, { "d1", "b" } });
        Console.WriteLine(Said(session.Identify(eye, seen())));
        var transport = session.Transport;
        session.Transport = (method, path, body) => { throw new WebException("out of reach"); };
        Console.WriteLine(Said(session.Identify(eye, seen())));
        try
        {
            session.Confirm();
        }
        catch (FarmArException problem)
        {
            Console.WriteLine(problem.Status + " " + problem.Field);
        }
        session.Transport = transport;
        session.Undo();
        Console.WriteLine(Said(session.Identify(eye, seen())));
        // The app's frame is turned by 90 degrees and begins at (1, 1) in the map.
        Console.WriteLine(session.Align(At("", 0, 0, 0), At("", 1, 1, Math.PI / 2)));
        Func<Thing[]> turned = () => seen().Select(one => At(one.Id, 1 - one.Z, one.X - 1, -1.4)).ToArray();
        Console.WriteLine(Said(session.Identify(eye, turned())));
        session.Transport = (method, path, body) => { throw new WebException("out of reach"); };
        Console.WriteLine(Said(session.Identify(eye, turned())));
        session.Transport = transport;
        try
        {
            new Session(url, "from-mono") { Pin = pin, Token = session.Token }.Begin(new[] { At("a", 0, 0, 0) });
        }
        catch (FarmArException problem)
        {
            Console.WriteLine(problem.Status + " " + problem.Field);
        }
        if (pin == null) return;
        try
        {
            new Session(url, "from-mono") { Pin = "00", Token = session.Token }.State();
        }
        catch (WebException)
        {
            Console.WriteLine("another certificate");
        }
    }
}
