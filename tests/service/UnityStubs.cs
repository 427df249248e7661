// As much of Unity's types as the sample uses, so that a compiler reads it.
using System;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }
    public struct Quaternion { public float x, y, z, w; }
    public struct Rect { public Rect(float x, float y, float width, float height) { } }
    public class Object { }
    public class GameObject : Object { public bool activeInHierarchy { get { return true; } } }
    public class Component : Object
    {
        public Transform transform { get { return null; } }
        public GameObject gameObject { get { return null; } }
    }
    public class Transform : Component
    {
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
    }
    public class MonoBehaviour : Component { }
    public class Camera : Component
    {
        public static Camera main { get { return null; } }
        public float fieldOfView, aspect, farClipPlane;
        public Vector3 WorldToScreenPoint(Vector3 place) { return place; }
    }
    [AttributeUsage(AttributeTargets.Field)]
    public class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public static class Mathf
    {
        public const float Deg2Rad = 1, Rad2Deg = 1;
        public static float Tan(float value) { return value; }
        public static float Atan(float value) { return value; }
    }
    public static class Time { public static double timeAsDouble { get { return 0; } } }
    public static class Screen { public static int height { get { return 0; } } }
    public static class GUI
    {
        public static bool enabled;
        public static void Label(Rect place, string text) { }
    }
    public static class GUILayout
    {
        public static void Label(string text) { }
        public static bool Button(string text) { return false; }
    }
}
